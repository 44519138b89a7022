"""What views cost: seconds to take them of generated rooms, bytes a picture, and pictures a second that are read.

    python benchmarks/views.py                             # 4 rooms x 400 poses x 2 takes, two minutes
    python benchmarks/views.py --views views               # reading alone, of a folder that is there
    python benchmarks/views.py --packings                  # how small and how fast chunks of pictures can be

Rooms are the first of `train`, seed 0. Taking is timed from the command's call to its end, with a process a core, and
builds the rooms anew; processor time is that of all workers together. Reading goes through `Views.batches`, in one
process, as a training does: shuffled, checked, from files that the system may have in memory. Colour alone and all
sensors are read in turn; the median of `--repeats` is told, and the spread, of a clock and of processor time, which
other programs disturb less.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import clearway
from clearway.views.stream import Views

BATCH = 256
PACKINGS: dict[str, dict[str, Any]] = {
    "none": {},
    "lzf": {"compression": "lzf"},
    "shuffle, lzf": {"compression": "lzf", "shuffle": True},
    "shuffle, gzip 1": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
}
SAMPLE = 256  # pictures that packings are tried on


def workers_s() -> float:
    """Processor seconds of all workers that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def taken(folder: Path, rooms: int, poses: int, perturb: list[str]) -> Path:
    """Views of so many rooms, with what they took."""
    clearway.generate("room", rooms, out=folder / "rooms", encoder="none")
    begin, busy = time.perf_counter(), workers_s()
    paths = clearway.take_views(
        folder / "rooms", out=folder / "views", poses=poses, perturb=perturb, sensors=("rgb", "depth")
    )
    seconds, busy = time.perf_counter() - begin, workers_s() - busy
    count = len(clearway.open_views(folder / "views"))
    size = sum(path.stat().st_size for path in paths) / count
    print(f"{rooms} rooms, {count} pictures with depth, {' '.join(perturb)}: {seconds:.1f} s, {count / seconds:.0f}/s")
    print(f"{busy:.1f} processor seconds, {count / busy:.0f}/s; {size:,.0f} bytes a picture with its depth\n")
    return folder / "views"


def read(views: Views, sensors: list[str], epoch: int) -> tuple[float, float]:
    """Pictures a second of an epoch: by the clock, and a second of processor time."""
    begin, busy = time.perf_counter(), time.process_time()
    count = sum(len(batch) for batch in views.batches(BATCH, epoch=epoch, sensors=sensors))
    return count / (time.perf_counter() - begin), count / (time.process_time() - busy)


def reading(views: Views, repeats: int) -> None:
    """A row for each choice of sensors."""
    names = [sensor.name for sensor in views.sensors]
    choices = [names[:1], names] if len(names) > 1 else [names]
    rates: dict[str, list[tuple[float, float]]] = {" and ".join(choice): [] for choice in choices}
    read(views, names, 0)
    for epoch in range(1, repeats + 1):
        for choice in choices:
            rates[" and ".join(choice)].append(read(views, choice, epoch))
    print("| read | pictures/s | spread | pictures a processor second |\n|---|---|---|---|")
    for label, found in rates.items():
        clock, busy = zip(*found, strict=True)
        spread = f"{min(clock):,.0f} - {max(clock):,.0f}"
        print(f"| {label} | {statistics.median(clock):,.0f} | {spread} | {statistics.median(busy):,.0f} |")


def packings(views: Views, repeats: int) -> Iterator[str]:
    """A row for each way to pack the first pictures of a room, in chunks as of a shard."""
    shard = views.shards[0]
    for sensor in views.sensors:
        pictures = shard.seen(sensor.name, slice(0, SAMPLE))
        rows = max(1, 512 * 1024 // pictures[0].nbytes)
        for label, options in PACKINGS.items():
            with tempfile.TemporaryDirectory() as folder:
                path, seconds = Path(folder) / "packed.h5", []
                with h5py.File(path, "w") as file:
                    chunks = (rows, *pictures.shape[1:])
                    file.create_dataset("seen", data=pictures, chunks=chunks, fletcher32=True, **options)
                for _ in range(repeats):
                    begin = time.process_time()
                    with h5py.File(path) as file:
                        back = file["seen"][:]
                    seconds.append(time.process_time() - begin)
                assert np.array_equal(back, pictures)
                size = path.stat().st_size / len(pictures)
            microseconds = 1e6 * statistics.median(seconds) / len(pictures)
            yield f"| {sensor.name} | {label} | {size:,.0f} | {microseconds:.0f} |"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=int, default=4)
    parser.add_argument("--poses", type=int, default=400)
    parser.add_argument("--perturb", nargs="+", default=["geometry"])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--views", type=Path, help="read these instead of taking any")
    parser.add_argument("--packings", action="store_true", help="try packings too")
    asked = parser.parse_args()
    print(f"{len(os.sched_getaffinity(0))} cores, load {os.getloadavg()[0]:.1f}\n")
    with tempfile.TemporaryDirectory() as folder:
        views = clearway.open_views(asked.views or taken(Path(folder), asked.rooms, asked.poses, asked.perturb))
        reading(views, asked.repeats)
        if asked.packings:
            print("\n| sensor | packing | bytes a picture | µs to read a picture |\n|---|---|---|---|")
            for row in packings(views, asked.repeats):
                print(row)


if __name__ == "__main__":
    main()
