"""How much one more process brings: requests a second of a service with 1 and with 2 replicas, in one run.

    python benchmarks/replicas.py generalist                 # two minutes; or a file that clearway export wrote

Rounds of one and of two replicas come in turns; each service is asked as in `benchmarks/serve.py`, by clients on the
same machine. The median round is printed, and the least and the most requests a second of all rounds.
"""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Sequence

from serving import served

from serve import TOKEN, Row, measured


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("agent", help="a file that clearway export wrote, a run folder, or generalist")
    parser.add_argument("--replicas", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--clients", type=int, nargs="+", default=[1, 4, 16])
    parser.add_argument("--seconds", type=float, default=6.0, help="for each number of clients and round")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args(arguments)
    found: dict[tuple[int, int], list[Row]] = {}
    for _ in range(options.rounds):
        for replicas in options.replicas:
            environment = {"CLEARWAY_TOKEN": TOKEN}
            with served(options.agent, "--replicas", str(replicas), environment=environment) as (url, _):
                asyncio.run(measured(url, max(options.clients), 1.0))  # until all replicas answer
                for clients in options.clients:
                    row = asyncio.run(measured(url, clients, options.seconds))
                    found.setdefault((clients, replicas), []).append(row)
    print("| clients | replicas | requests/s (least-most) | p50 ms | p99 ms | pictures a batch |")
    print("| --- | --- | --- | --- | --- | --- |")
    for (clients, replicas), rows in sorted(found.items()):
        rows.sort()
        row = rows[len(rows) // 2]
        speed = f"{row.per_s:.1f} ({rows[0].per_s:.1f}-{rows[-1].per_s:.1f})"
        print(f"| {clients} | {replicas} | {speed} | {row.p50_ms:.0f} | {row.p99_ms:.0f} | {row.batch:.1f} |")


if __name__ == "__main__":
    main()
