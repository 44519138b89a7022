"""Steps a second off the grid, with rendering: `Clearway/LiveImageGoal-v0`.

    python benchmarks/live_env.py                     # the four rooms, a minute
    python benchmarks/live_env.py --room bathroom --num-envs 1 8 32

Random actions; every step renders what the agent sees, 96 x 128 pixels unless other sizes are asked for, and every new
episode its target as well. The batch shares one room and has a renderer process a core; `async` is Gymnasium's
`AsyncVectorEnv` with as many processes as there are cores, each with a room and a renderer. `moves` are steps a second
of the episode alone, without pictures, on one core: body, zones, clearance and reward. Rooms are built, and the first
steps taken, before the clock starts. Repeats are interleaved, and the median and the spread are told; `processor` is
the processor time of a step, of all processes together (Linux): two free cores make 2,000 by it steps a second at most.
Another version of clearway measures beside this one with `--beside PATH/TO/src`, in processes of its own.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from family import processor_s

import clearway.envs  # noqa: F401 (registers)
from clearway.envs.registration import LIVE_ENV_ID
from clearway.live_envs.vector import LiveImageGoalVectorEnv
from clearway.rooms import ROOM_NAMES

WARM_UP = 5  # steps


def steps_per_s(envs: gymnasium.vector.VectorEnv, seconds: float) -> float:
    """Steps of all environments together a second, for about so long."""
    count, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        envs.step(envs.action_space.sample())
        count += envs.num_envs
    return count / (time.perf_counter() - begin)


def moves_per_s(envs: LiveImageGoalVectorEnv, seconds: float) -> float:
    """Steps of one episode after the other a second, without pictures."""
    episodes, rng = envs._episodes, np.random.default_rng(0)
    actions = rng.integers(4, size=10_000).tolist()
    episode, count, begin = episodes.begin(episodes.planned(0)), 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        if episode.step(actions[count % len(actions)]).ended:
            episode = episodes.begin(episodes.planned(count), last=episode)
        count += 1
    return count / (time.perf_counter() - begin)


@dataclass(frozen=True)
class Rate:
    """Steps a second, and processor time of a step in milliseconds."""

    steps_per_s: float
    processor_ms: float


def measure(rate: Callable[[float], float], seconds: float) -> Rate:
    """A rate with its processor time."""
    begin, before = time.perf_counter(), processor_s()
    found = rate(seconds)
    steps = found * (time.perf_counter() - begin)
    return Rate(found, 1_000 * (processor_s() - before) / steps)


def opened(room: str, count: int, size: Mapping[str, Any], **how: Any) -> gymnasium.vector.VectorEnv:
    """A batch that has taken its first steps."""
    envs = gymnasium.make_vec(LIVE_ENV_ID, num_envs=count, room=room, **how, **size)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(WARM_UP):
        envs.step(envs.action_space.sample())
    return envs


def answer(room: str, count: int, size: Mapping[str, int]) -> None:
    """Measure for as many seconds as each line of standard input says: what `--beside` asks another version."""
    envs = opened(room, count, size)
    print("ready", flush=True)
    for line in sys.stdin:
        rate = measure(lambda seconds: steps_per_s(envs, seconds), float(line))
        print(rate.steps_per_s, rate.processor_ms, flush=True)
    envs.close()


def asking(source: str, room: str, count: int, size: Mapping[str, int]) -> Callable[[float], Rate]:
    """What measures with the clearway of another folder, in a process that ends with this one."""
    words = ["--room", room, "--num-envs", str(count), "--answer"]
    words += ["--height-px", str(size["height_px"]), "--width-px", str(size["width_px"])]
    other = subprocess.Popen(
        [sys.executable, __file__, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": source},
    )
    assert other.stdin is not None and other.stdout is not None
    asked, told = other.stdin, other.stdout
    if told.readline().strip() != "ready":
        raise SystemExit(f"--beside {source}: does not run. See above")

    def rate(seconds: float) -> Rate:
        print(seconds, file=asked, flush=True)
        steps_per_s, processor_ms = map(float, told.readline().split())
        return Rate(steps_per_s, processor_ms)

    return rate


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", nargs="+", default=list(ROOM_NAMES), help="names or files")
    parser.add_argument("--num-envs", nargs="+", type=int, default=[1, 8, 32])
    parser.add_argument("--height-px", type=int, default=96)
    parser.add_argument("--width-px", type=int, default=128)
    parser.add_argument("--seconds", type=float, default=2.0, help="of each measurement")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--beside", help="folder of another version of clearway")
    parser.add_argument("--answer", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    size = {"height_px": asked.height_px, "width_px": asked.width_px}
    if asked.answer:
        answer(asked.room[0], asked.num_envs[0], size)
        return
    cores = len(os.sched_getaffinity(0))
    print(f"{platform.processor() or platform.machine()}, {cores} cores, {asked.height_px} x {asked.width_px} pixels")
    print("| room | environments | steps/s | spread | processor, ms a step |\n|---|---|---|---|---|")
    for room in asked.room:
        batches = {f"batch of {count}": opened(room, count, size) for count in asked.num_envs}
        one = next(iter(batches.values()))
        assert isinstance(one, LiveImageGoalVectorEnv)
        batches[f"async, {cores}"] = opened(room, cores, size, vectorization_mode="async")
        rates: dict[str, Callable[[float], Rate]] = {}
        for name, envs in batches.items():
            rates[name] = partial(measure, partial(steps_per_s, envs))
        for count in asked.num_envs if asked.beside else ():
            rates[f"batch of {count}, {asked.beside}"] = asking(asked.beside, room, count, size)
        rates["moves"] = partial(measure, partial(moves_per_s, one))
        found: dict[str, list[Rate]] = {name: [] for name in rates}
        for _ in range(asked.repeats):
            for name, rate in rates.items():
                found[name].append(rate(asked.seconds))
        for name, measured in found.items():
            steps = [one.steps_per_s for one in measured]
            spread = f"{min(steps):,.0f} - {max(steps):,.0f}"
            processor = statistics.median(one.processor_ms for one in measured)
            print(f"| {room} | {name} | {statistics.median(steps):,.0f} | {spread} | {processor:.2f} |")
        for envs in batches.values():
            envs.close()


if __name__ == "__main__":
    main()
