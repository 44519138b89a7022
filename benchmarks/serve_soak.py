"""Whether a service's memory stays flat: robots come and go, and hostile pictures with them. Linux.

    python benchmarks/serve_soak.py generalist                   # half an hour; or a file, or a run folder
    python benchmarks/serve_soak.py generalist --minutes 6 --warm-up 2

Robots open sessions, step for half a minute, and leave, by requests and by WebSockets in turn; others send hostile
pictures all the while, as in `serve_attack.py`. Every five seconds the resident memory of the service and of all its
processes is added up. `--record FILE` keeps what was seen, as JSON.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import threading
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from statistics import median

import httpx
from family import family, resident_mib
from serve_attack import (
    ROBOTS,
    Step,
    attacking,
    by_requests,
    counted,
    hostile_pictures,
    served_to_robots,
    walked,
)
from websockets.asyncio.client import connect

LOOKS_EVERY_S = 5.0
VISIT_S = 30.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for each minute, then what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("agent", help="a file that clearway export wrote, a run folder, or generalist")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--warm-up", type=float, default=5.0, help="minutes that do not count")
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--every-s", type=float, default=0.5, help="between the steps of a robot")
    parser.add_argument("--attack-per-s", type=float, default=2.0, help="hostile pictures a second")
    parser.add_argument("--record", type=Path, help="a file for what was seen, as JSON")
    options = parser.parse_args(arguments)
    acts, seen, over = [0, 0], list[tuple[float, float]](), threading.Event()
    with served_to_robots(options.agent) as (url, pid):
        watcher = threading.Thread(target=watched, args=(pid, seen, over))
        watcher.start()
        try:
            with attacking(url, hostile_pictures(), options.attack_per_s):
                until, visit = time.monotonic() + 60 * options.minutes, 0
                while time.monotonic() < until:
                    stepping = by_stream if visit % 2 else by_requests
                    acts[visit % 2] += len(asyncio.run(walked(url, options.robots, options.every_s, VISIT_S, stepping)))
                    visit += 1
            figures = counted(url)
        finally:
            over.set()
            watcher.join()
    report(acts, seen, figures, options.warm_up, options.record)


def report(
    acts: list[int], seen: list[tuple[float, float]], figures: dict[str, float], warm_up: float, record: Path | None
) -> None:
    """Print what was seen; keep it, where a file is named."""
    minutes: dict[int, list[float]] = {}
    for second, mib in seen:
        minutes.setdefault(int(second // 60), []).append(mib)
    rows = [[minute, round(median(values)), round(max(values))] for minute, values in minutes.items()]
    print("| minute | MiB, median | most |\n|---|---|---|")
    print("\n".join(f"| {minute} | {middle} | {most} |" for minute, middle, most in rows))
    after = [mib for second, mib in seen if second >= 60 * warm_up]
    first, last = median(after[: len(after) // 2]), median(after[len(after) // 2 :])
    print(f"{acts[0]} acts by requests, {acts[1]} by WebSockets")
    print(f"after {warm_up:g} minutes: first half {first:.0f} MiB, second half {last:.0f} MiB")
    if record is not None:
        said = {"acts": dict(zip(("requests", "streams"), acts, strict=True)), "counted": figures}
        halves = {"warm_up_minutes": warm_up, "first_half_mib": round(first, 1), "second_half_mib": round(last, 1)}
        record.write_text(json.dumps({**said, **halves, "minute_median_most_mib": rows}) + "\n", encoding="utf-8")


@asynccontextmanager
async def by_stream(http: httpx.AsyncClient, url: str, path: str) -> AsyncIterator[Step]:
    """Steps of a session by a WebSocket."""
    bearing = {"authorization": ROBOTS["authorization"]}
    async with connect(f"{url.replace('http', 'ws', 1)}{path}/stream", additional_headers=bearing) as stream:

        async def step(picture: bytes) -> None:
            await stream.send(picture)
            answer = json.loads(await stream.recv())
            assert "error" not in answer, f"a robot was refused: {answer}"

        yield step


def watched(pid: int, seen: list[tuple[float, float]], over: threading.Event) -> None:
    """Add seconds since the begin, and MiB, until it is over."""
    begun = time.monotonic()
    while not over.wait(LOOKS_EVERY_S):
        seen.append((time.monotonic() - begun, sum(map(resident_mib, family(pid)))))


if __name__ == "__main__":
    main()
