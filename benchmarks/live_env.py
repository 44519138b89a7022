"""Steps a second off the grid, with rendering: `Clearway/LiveImageGoal-v0`.

    python benchmarks/live_env.py                     # the four rooms, a minute
    python benchmarks/live_env.py --room bathroom --num-envs 1 8 32

Random actions; every step renders what the agent sees, 96 x 128 pixels unless other sizes are asked for, and every new
episode its target as well. The batch shares one room and has a renderer process a core; `async` is Gymnasium's
`AsyncVectorEnv` with as many processes as there are cores, each with a room and a renderer. `moves` are steps a second
of the episode alone, without pictures, on one core: body, zones, clearance and reward. Rooms are built, and the first
steps taken, before the clock starts. Repeats are interleaved, and the median and the spread are told.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable

import gymnasium
import numpy as np

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
    episode, count, begin = episodes.begin(0), 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        if episode.step(actions[count % len(actions)]).ended:
            episode = episodes.begin(count, last=episode)
        count += 1
    return count / (time.perf_counter() - begin)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", nargs="+", default=list(ROOM_NAMES), help="names or scene files")
    parser.add_argument("--num-envs", nargs="+", type=int, default=[1, 8, 32])
    parser.add_argument("--height-px", type=int, default=96)
    parser.add_argument("--width-px", type=int, default=128)
    parser.add_argument("--seconds", type=float, default=2.0, help="of each measurement")
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    print(f"{platform.processor() or platform.machine()}, {cores} cores, {asked.height_px} x {asked.width_px} pixels")
    size = {"height_px": asked.height_px, "width_px": asked.width_px}
    print("| room | environments | steps/s | spread |\n|---|---|---|---|")
    for room in asked.room:
        batches = {
            f"batch of {count}": gymnasium.make_vec(LIVE_ENV_ID, num_envs=count, room=room, **size)
            for count in asked.num_envs
        }
        one = next(iter(batches.values()))
        batches[f"async, {cores}"] = gymnasium.make_vec(
            LIVE_ENV_ID, num_envs=cores, vectorization_mode="async", room=room, **size
        )
        measured: dict[str, Callable[[float], float]] = {}
        for name, envs in batches.items():
            envs.reset(seed=0)
            envs.action_space.seed(0)
            for _ in range(WARM_UP):
                envs.step(envs.action_space.sample())
            measured[name] = lambda seconds, envs=envs: steps_per_s(envs, seconds)
        assert isinstance(one, LiveImageGoalVectorEnv)
        measured["moves"] = lambda seconds, one=one: moves_per_s(one, seconds)
        found: dict[str, list[float]] = {name: [] for name in measured}
        for _ in range(asked.repeats):
            for name, measure in measured.items():
                found[name].append(measure(asked.seconds))
        for name, rates in found.items():
            print(f"| {room} | {name} | {statistics.median(rates):,.0f} | {min(rates):,.0f} - {max(rates):,.0f} |")
        for envs in batches.values():
            envs.close()


if __name__ == "__main__":
    main()
