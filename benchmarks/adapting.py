"""Frames and seconds until every target is solved: from nothing, and by adapting the generalist, in the same run.

    python benchmarks/adapting.py office.h5 --targets 5 20 --seeds 0 1 2      # scenes encoded by --encoder clearway
    python benchmarks/adapting.py office.h5 --without-walks                   # and adapting without the generalist's

Solved: every one of 100 sampled episodes of each target from random starts ends at it in under 500 steps (`solving`).
Looked at after every update, with the clock stopped. Frames count whatever is walked, the generalist's walks too;
seconds making the trainer and its updates.
"""

from __future__ import annotations

import argparse
import json
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from learning_curve import agent_of
from solving import SCREENING_EPISODES, solved_count

from clearway.evaluation.episodes import EPISODES_PER_TARGET
from clearway.learn.adapt import Adapt
from clearway.learn.learner import Learner
from clearway.learn.presets import DEFAULT
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.train import RunRequest, set_threads
from clearway.reward import COLLISION_AWARE
from clearway.scenes.scene import Scene
from clearway.scenes.targets import seeded_targets
from clearway.scenes.thor_v1 import read_scene


def solved_after(scene: Scene, targets: tuple[int, ...], learner: Learner, seed: int) -> tuple[int, float] | None:
    """Frames and seconds of training until every target is solved; None: not in all its frames."""
    since = time.perf_counter()
    with closing(RunRequest([scene], {scene.name: targets}, learner, COLLISION_AWARE, seed).trainer()) as trainer:
        seconds = time.perf_counter() - since
        while not trainer.finished:
            since = time.perf_counter()
            trainer.update()
            seconds += time.perf_counter() - since
            agent = agent_of(trainer)
            looks = (SCREENING_EPISODES, EPISODES_PER_TARGET)
            if all(solved_count(trainer.world, agent, episodes) == len(targets) for episodes in looks):
                return trainer.frames, seconds
    return None


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--targets", nargs="+", type=int, default=[5])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--threads", type=int)
    parser.add_argument("--without-walks", action="store_true", help="adapting with a tour of one step, too")
    parser.add_argument("--json", type=Path, help="where the record is written, after each row")
    args = parser.parse_args()
    set_threads(args.threads)
    learners: dict[str, Learner] = {"adapted": Adapt(), "from nothing": DEFAULT}
    if args.without_walks:
        learners["adapted without walks"] = replace(Adapt(), tour_steps=1, walks=1, walk_steps=1)
    print("| scene | targets | seed | " + " | ".join(f"{name}: frames, s" for name in learners) + " |")
    print("|---" * (3 + len(learners)) + "|")
    rows: list[dict[str, object]] = []
    for path in args.scenes:
        scene = read_scene(path)
        for count in args.targets:
            for seed in args.seeds:
                found = [solved_after(scene, seeded_targets(scene, count), one, seed) for one in learners.values()]
                cells = ["not solved" if one is None else f"{one[0]:,}, {one[1]:.1f}" for one in found]
                print(f"| {scene.name} | {count} | {seed} | " + " | ".join(cells) + " |", flush=True)
                rows.append(
                    {"scene": scene.name, "targets": count, "seed": seed, **dict(zip(learners, found, strict=True))}
                )
                if args.json:
                    about = {"versions": package_versions(), "hardware": hardware(), "frames, seconds": rows}
                    args.json.write_text(json.dumps(about) + "\n")


if __name__ == "__main__":
    main()
