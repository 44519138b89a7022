"""How a training on very many rooms starts: seconds until its first update, and memory of each process.

    python benchmarks/many_scenes.py rooms-10000                  # 10,000 rooms of 1,000 states; two workers
    python benchmarks/many_scenes.py rooms-300 --rooms 300

The rooms are made up and written to the folder where it is not there: 16 x 18 cells with furniture at random, of which
the largest connected part is kept, and smooth random features. A hundred differ; the others are copies under other
names, which nothing in training makes use of. One update follows, of an environment a room.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from family import family

from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.grid import connected_parts, neighbour_pairs
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.thor_v1 import write_scene

DISTINCT = 100
WIDTH, DEPTH, FREE = 16, 18, 0.89  # cells, cells, share
STEPS = 2  # of the rollout


def made_plan(number: int) -> FloorPlan:
    """A room's plan, of about 250 cells."""
    free = np.random.default_rng(number).random((WIDTH, DEPTH)) < FREE
    cells = np.argwhere(free)
    part, _ = connected_parts(len(cells), neighbour_pairs(cells)[0])
    return FloorPlan(f"room-{number}", cells[part == 0])


def make_rooms(folder: Path, rooms: int, features: int) -> None:
    """Write those that are not there."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(rooms):
        path = folder / f"room-{number:05}.h5"
        if path.exists():
            continue
        if number < DISTINCT:
            write_scene(floor_plan_scene(made_plan(number), features), path)
        else:
            shutil.copyfile(folder / f"room-{number % DISTINCT:05}.h5", path)


def memory_gb(pid: int) -> float:
    """Of a process now, without pages of mapped files, which the system takes back where it needs room."""
    try:
        status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
        return int(status["RssAnon"].split()[0]) / 1e6
    except (FileNotFoundError, ProcessLookupError, KeyError):
        return 0.0


def main() -> None:
    """Make rooms, train one update, print figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rooms", type=int, default=10_000)
    parser.add_argument("--features", type=int, default=64)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    make_rooms(given.folder, given.rooms, given.features)
    with tempfile.TemporaryDirectory(dir=given.folder.parent) as temporary:
        out = Path(temporary) / "run"
        settings = [f"envs={given.rooms}", f"rollout_steps={STEPS}", "minibatches=1", "epochs=1", "heads=shared"]
        command = [sys.executable, "-m", "clearway", "train", str(given.folder), "--out", str(out), "--threads", "1"]
        command += ["--workers", str(given.workers), "--feature-store", "mapped", "--frames", str(STEPS * given.rooms)]
        most: dict[int, float] = {}
        started, began = time.time(), 0.0
        with subprocess.Popen([*command, "--set", *settings], stdout=subprocess.DEVNULL) as process:
            while process.poll() is None:
                for pid in family(process.pid):
                    most[pid] = max(most.get(pid, 0.0), memory_gb(pid))
                if not began and (out / "run.json").exists():
                    began = time.time()
                time.sleep(0.2)
        took_s = time.time() - started
        if process.returncode:
            raise SystemExit(process.returncode)
        written = os.stat(out / "metrics.jsonl").st_mtime
        row = json.loads((out / "metrics.jsonl").read_text().splitlines()[-1])
    print(f"{given.rooms:,} rooms, {given.features} features, {given.workers} workers")
    print(
        f"run folder begun after {began - started:.1f} s; first update after {written - row['seconds'] - started:.1f} s"
    )
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = used.ru_utime + used.ru_stime
    print(f"the update took {row['seconds']:.1f} s; all of it {took_s:.1f} s, and {cpu_s:.1f} s of processor")
    print(f"memory of each process, GB at most: {', '.join(f'{gb:.2f}' for gb in most.values() if gb > 0.05)}")


if __name__ == "__main__":
    main()
