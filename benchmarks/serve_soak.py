"""Whether a service's memory stays flat: robots come and go, and hostile pictures with them. Linux.

    python benchmarks/serve_soak.py generalist                   # half an hour; or a file, or a run folder
    python benchmarks/serve_soak.py generalist --minutes 6 --warm-up 2

Robots open sessions, step for half a minute, and leave; others send hostile pictures all the while, as in
`serve_attack.py`. Every five seconds the resident memory of the service and of all its processes is added up.
"""

from __future__ import annotations

import argparse
import asyncio
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from serve_attack import attacking, hostile_pictures, served_to_robots, walked

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
    options = parser.parse_args(arguments)
    acts, seen, over = 0, list[tuple[float, float]](), threading.Event()
    with served_to_robots(options.agent) as (url, pid):
        watcher = threading.Thread(target=watched, args=(pid, seen, over))
        watcher.start()
        try:
            with attacking(url, hostile_pictures(), options.attack_per_s):
                until = time.monotonic() + 60 * options.minutes
                while time.monotonic() < until:
                    acts += len(asyncio.run(walked(url, options.robots, options.every_s, VISIT_S)))
        finally:
            over.set()
            watcher.join()
    minutes: dict[int, list[float]] = {}
    for second, mib in seen:
        minutes.setdefault(int(second // 60), []).append(mib)
    print("| minute | MiB, median | most |\n|---|---|---|")
    for minute, values in minutes.items():
        print(f"| {minute} | {median(values):.0f} | {max(values):.0f} |")
    counted = [mib for second, mib in seen if second >= 60 * options.warm_up]
    half = len(counted) // 2
    first, last = median(counted[:half]), median(counted[half:])
    print(f"{acts} acts; after {options.warm_up:g} minutes: first half {first:.0f} MiB, second half {last:.0f} MiB")


def watched(pid: int, seen: list[tuple[float, float]], over: threading.Event) -> None:
    """Add seconds since the begin, and MiB, until it is over."""
    begun = time.monotonic()
    while not over.wait(LOOKS_EVERY_S):
        seen.append((time.monotonic() - begun, sum(map(resident_mib, family(pid)))))


def family(pid: int) -> list[int]:
    """A process and all that it and those have started."""
    found = [pid]
    for each in found:
        for task in Path(f"/proc/{each}/task").glob("*/children"):
            found += [int(child) for child in task.read_text().split()]
    return found


def resident_mib(pid: int) -> float:
    """Resident memory of a process; 0 where it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS:")), 0.0)


if __name__ == "__main__":
    main()
