"""Has the soft fixed point others beside it? Solved again from many values to begin from, in a default room.

    python benchmarks/fixed_points.py            # the bathroom, 8 beginnings for each target, reward and entropy weight

Half of the beginnings are the same for all states, half drawn for each (normal); their scale is between 0.001 and 100
times the reward of a target that is clipped. Printed is the largest difference of an action's probability.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from clearway.evaluation.oracle import DISCOUNT, make_task, soft_policy
from clearway.reward import BUMP, COLLISION_AWARE, SHORTEST
from clearway.rooms.library import cached_room_scene
from clearway.scenes.targets import default_targets
from clearway.zones import pose_zones

ENTROPY_WEIGHTS = (0.0001, 0.001, 0.01, 0.1, 1.0)


def main() -> None:
    """Print a line for each reward and entropy weight."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--room", default="bathroom")
    parser.add_argument("--beginnings", type=int, default=8)
    options = parser.parse_args()
    scene, rng = cached_room_scene(options.room), np.random.default_rng(0)
    zones, solved = pose_zones(scene.graph), 0
    for reward in (replace(own, clip=clip) for own in (SHORTEST, COLLISION_AWARE, BUMP) for clip in (True, False)):
        for weight in ENTROPY_WEIGHTS:
            largest = 0.0
            for target in default_targets(scene):
                task = make_task(scene.graph, zones, int(target), reward)
                own = soft_policy(task, DISCOUNT, weight)
                for number in range(options.beginnings):
                    scale = 10.0 ** rng.uniform(-3, 2)
                    drawn = (
                        rng.normal(0, scale, len(own)) if number % 2 else np.full(len(own), rng.uniform(-1, 1) * scale)
                    )
                    found = soft_policy(task, DISCOUNT, weight, drawn)
                    largest, solved = max(largest, float(np.abs(found - own)[task.starts].max())), solved + 1
            clipped = "clipped" if reward.clip else "not clipped"
            print(f"{reward.name}, {clipped}, entropy weight {weight:g}: largest difference {largest:.1e}", flush=True)
    print(f"{solved:,} solved")


if __name__ == "__main__":
    main()
