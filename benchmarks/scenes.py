"""What large sets of scenes cost: opening, the world's tables, memory, and training speed against four rooms.

    python benchmarks/scenes.py                                        # 4 and 40 rooms, a minute or two
    python benchmarks/scenes.py --rooms 4 100 1000 --store float16     # up to a million states, half an hour
    python benchmarks/scenes.py --rooms 1000 --at-once 0 8             # all rooms at the same time, and eight in turn
    python benchmarks/scenes.py --rooms 1000 --basis 256               # features in 256 principal directions

Rooms are random floor plans of about `--states` states, made on the spot with `--features` made-up features, and
written to scene files. Only `--files` different ones are made, and every file is opened under many names: as many
reads, checks, tables and states, less disk. The first row is always four rooms, and everything is measured in the same
run, a process for each size, updates of both sizes in turn, so that whatever else the machine does hits both alike.

    open         read a scene with its features left in the file, ms a scene, checks included
    world        tables, starts and distances of five targets a scene, and features read into the store, s
    ready        from the world to the first update: the feature map is fitted, features are prepared, s
    memory       resident at the end, GiB, without what is mapped from files; largest: at any time, with it
    frames/s     of the default learner with the same environments and steps at every size: median, smallest, largest
    of 4 rooms   that, as a share of four rooms' frames/s: the median of pairs of updates, one after the other
    by CPU       the same by the processor time of the updates, which other programs on the machine disturb less

`at once`: scenes that are walked at the same time, in turn with the others; by default all.
`heads`: whether every scene has its own last layers, as published, or all share one (see `clearway.learn.on_policy`).
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from itertools import product
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import torch

from clearway.choices import FeatureStore
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.targets import seeded_targets
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.world.world import make_world

FEW_ROOMS = 4
BLOCKED_SHARE = 0.2
ENDLESS = 10**9


@dataclass(frozen=True)
class Size:
    """What is measured: so many rooms, the store of their features, the learner."""

    rooms: int
    store: FeatureStore
    learner: OnPolicy


@dataclass
class Costs:
    """One row of the table; see the head of the file for units."""

    rooms: int
    at_once: int
    states: int
    heads: str
    store: str
    open_ms: float
    world_s: float
    ready_s: float
    memory_gib: float = 0.0
    largest_gib: float = 0.0
    frames_per_s: float = 0.0
    frames_per_s_min: float = 0.0
    frames_per_s_max: float = 0.0
    of_few_rooms: float = 1.0
    of_few_rooms_by_cpu: float = 1.0


def grown_plan(name: str, states: int, seed: int) -> FloorPlan:
    """A random floor plan of about so many states, all of it connected: growing squares until one has them."""
    from scipy import ndimage

    rng, cells = np.random.default_rng(seed), states // 4
    side = int(np.sqrt(cells / (1 - BLOCKED_SHARE)))
    while True:
        regions, _ = ndimage.label(rng.random((side, side)) > BLOCKED_SHARE)
        largest = regions == 1 + np.bincount(regions[regions > 0] - 1).argmax()
        if largest.sum() >= cells:
            return FloorPlan(name, np.argwhere(largest)[:cells])
        side += 1


def written_rooms(folder: Path, count: int, states: int, features: int) -> list[Path]:
    """Scene files of different rooms."""
    paths = [folder / f"plan_{number}.h5" for number in range(count)]
    for number, path in enumerate(paths):
        write_scene(floor_plan_scene(grown_plan(path.stem, states, number), features), path)
    return paths


def worker(connection: Connection, size: Size, paths: Sequence[Path], threads: int) -> None:
    """Open, build, then do an update whenever asked; sends the costs, then seconds and CPU seconds of every update."""
    torch.set_num_threads(threads)
    clock = Clock()
    scenes = [read_scene(paths[n % len(paths)], name=f"room_{n}", features_in_file=True) for n in range(size.rooms)]
    opened = clock.lap()
    targets = {scene.name: seeded_targets(scene) for scene in scenes}
    world = make_world(scenes, targets, feature_store=size.store)
    tables = clock.lap()
    trainer = Trainer(world, size.learner, COLLISION_AWARE, seed=0)
    costs = Costs(
        rooms=size.rooms,
        at_once=min(size.learner.scenes_at_once or size.rooms, size.rooms),
        states=world.state_count,
        heads=size.learner.heads,
        store=size.store,
        open_ms=1000 * opened / size.rooms,
        world_s=tables,
        ready_s=clock.lap(),
    )
    connection.send(costs)
    while connection.recv():
        clock.lap()
        used = time.process_time()
        trainer.update()
        connection.send((clock.lap(), time.process_time() - used))
    costs.memory_gib, costs.largest_gib = resident_gib()
    connection.send(costs)


class Clock:
    """Seconds from lap to lap."""

    def __init__(self) -> None:
        self.then = time.perf_counter()

    def lap(self) -> float:
        """Seconds since the last call, or since it was made."""
        then, self.then = self.then, time.perf_counter()
        return self.then - then


def resident_gib() -> tuple[float, float]:
    """Memory of this process now, without pages of files, and the most it ever had, with them; NaN off Linux."""
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024**2 if sys.platform == "linux" else 1024**3)
    status = Path("/proc/self/status")
    lines = dict(line.split(":", 1) for line in status.read_text().splitlines()) if status.exists() else {}
    return int(lines["RssAnon"].split()[0]) / 1024**2 if lines else float("nan"), largest


@contextmanager
def started(size: Size, paths: Sequence[Path], threads: int) -> Iterator[Connection]:
    """A worker process, ended on the way out."""
    here, there = get_context("spawn").Pipe()
    process = get_context("spawn").Process(target=worker, args=(there, size, paths, threads), daemon=True)
    process.start()
    there.close()
    try:
        yield here
    finally:
        process.join(30)
        process.kill()


def updated(connection: Connection) -> tuple[float, float]:
    """Seconds of one update, and of the processor."""
    connection.send(True)
    return connection.recv()


def finished(connection: Connection, costs: Costs, frames: int, seconds: Sequence[float]) -> Costs:
    """The costs with memory and speed."""
    connection.send(False)
    memory = connection.recv()
    rates = sorted(frames / s for s in seconds)
    return replace(
        costs,
        memory_gib=memory.memory_gib,
        largest_gib=memory.largest_gib,
        frames_per_s=statistics.median(rates),
        frames_per_s_min=rates[0],
        frames_per_s_max=rates[-1],
    )


def measured(
    size: Size, few: Connection, paths: Sequence[Path], threads: int, warm: int, repeats: int
) -> tuple[Costs, list[float]]:
    """The costs of a size, and the seconds of four rooms' updates beside its own."""
    frames = size.learner.envs * size.learner.rollout_steps
    with started(size, paths, threads) as many:
        costs = many.recv()
        for _ in range(warm):
            updated(many)
        pairs = [(updated(many), updated(few)) for _ in range(repeats)]
        costs = finished(many, costs, frames, [seconds for (seconds, _), _ in pairs])
    shares = [statistics.median(beside[clock] / own[clock] for own, beside in pairs) for clock in (0, 1)]
    return replace(costs, of_few_rooms=shares[0], of_few_rooms_by_cpu=shares[1]), [few[0] for _, few in pairs]


def table(rows: Sequence[Costs]) -> str:
    """The rows as text."""
    line = "{:>6} {:>7} {:>10} {:>7} {:>8} {:>8} {:>8} {:>8} {:>7} {:>8} {:>9} {:>17} {:>11} {:>7}"
    text = [
        line.format(
            *(
                "rooms",
                "at once",
                "states",
                "heads",
                "store",
                "open ms",
                "world s",
                "ready s",
                "memory",
                "largest",
                "frames/s",
            ),
            *("min - max", "of 4 rooms", "by CPU"),
        )
    ]
    for row in rows:
        text.append(
            line.format(
                row.rooms,
                row.at_once,
                f"{row.states:,}",
                row.heads,
                row.store,
                f"{row.open_ms:.1f}",
                f"{row.world_s:.1f}",
                f"{row.ready_s:.1f}",
                f"{row.memory_gib:.2f}",
                f"{row.largest_gib:.2f}",
                f"{row.frames_per_s:,.0f}",
                f"{row.frames_per_s_min:,.0f} - {row.frames_per_s_max:,.0f}",
                f"{row.of_few_rooms:.0%}",
                f"{row.of_few_rooms_by_cpu:.0%}",
            )
        )
    return "\n".join(text)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", type=int, nargs="+", default=[40], help="sizes beside four rooms")
    parser.add_argument("--states", type=int, default=1000, help="of a room, about")
    parser.add_argument("--features", type=int, default=2048, help="of a state")
    parser.add_argument("--files", type=int, default=8, help="different rooms")
    parser.add_argument("--store", nargs="+", default=["float16"], help="stores of the features: memory float16 mapped")
    parser.add_argument("--heads", nargs="+", default=["shared"], help="of the network: shared scene")
    parser.add_argument("--at-once", type=int, nargs="+", default=[0], help="rooms walked at the same time; 0: all")
    parser.add_argument("--basis", type=int, default=0, help="principal directions of the features; 0: features as is")
    parser.add_argument("--envs", type=int, default=1600, help="environments, at least as many as rooms at once")
    parser.add_argument("--steps", type=int, default=20, help="of every environment between updates")
    parser.add_argument("--warm", type=int, default=2, help="updates before measuring")
    parser.add_argument("--repeats", type=int, default=5, help="updates measured")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="of torch")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    options = parser.parse_args()
    base = replace(DEFAULT, frames=ENDLESS, envs=options.envs, rollout_steps=options.steps, feature_basis=options.basis)
    rows: list[Costs] = []
    with tempfile.TemporaryDirectory() as folder:
        paths = written_rooms(Path(folder), options.files, options.states, options.features)
        for heads in options.heads:
            learner = replace(base, heads=heads)
            few_size = Size(FEW_ROOMS, "memory", learner)
            with started(few_size, paths, options.threads) as few:
                costs, beside = few.recv(), []
                for _ in range(options.warm):
                    updated(few)
                row_of_few = len(rows)
                for store, rooms, at_once in product(options.store, options.rooms, options.at_once):
                    size = Size(rooms, store, replace(learner, scenes_at_once=at_once))
                    many, seconds = measured(size, few, paths, options.threads, options.warm, options.repeats)
                    rows.append(many)
                    beside += seconds
                rows.insert(row_of_few, finished(few, costs, learner.envs * learner.rollout_steps, beside))
    machine = {"cores": os.cpu_count(), "threads": options.threads, "load": os.getloadavg()[0]}
    if options.json:
        print(json.dumps({**machine, "torch": torch.__version__, "sizes": [asdict(row) for row in rows]}, indent=2))
        return
    print(f"{machine['cores']} cores, {options.threads} threads, load {machine['load']:.1f} at the end")
    print(f"{options.envs} environments x {options.steps} steps, {options.features} features, basis {options.basis}\n")
    print(table(rows))


if __name__ == "__main__":
    main()
