"""The generalist in rooms that it has never entered, beside the same agent to which collisions cost nothing.

    python benchmarks/generalist.py rooms-test                          # no tour; collision cost 16 and 0
    python benchmarks/generalist.py rooms-test --tour 500               # and who goes by the tour's nearest pictures
    python benchmarks/generalist.py rooms-test --perturb all
    python benchmarks/generalist.py rooms-test --json record.json       # figures of every scene

Scenes are files or folders of them, with pictures. All agents walk to the same goals from the same starts. Intervals
are of the mean over scenes: scenes are drawn anew, 2,000 times (Efron & Tibshirani 1993), and so are differences, scene
by scene.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from retrieval import Retrieving

import clearway
from clearway.agents.generalist import Generalist
from clearway.evaluation.bootstrap import RESAMPLES, intervals
from clearway.evaluation.goals import GoalEvaluation
from clearway.learn.provenance import hardware, package_versions

SHOWN = ("success", "success_4x", "spl", "collisions", "steps", "false_arrivals", "missed_arrivals")
COUNTS = ("collisions", "steps")
CARELESS, RETRIEVAL = "collisions cost nothing", "nearest picture of the tour"


def column(evaluation: GoalEvaluation, name: str) -> np.ndarray:
    """(scenes,) a figure of each scene; NaN where there is none."""
    values = [getattr(figures, name) for figures in evaluation.scenes.values()]
    return np.array([np.nan if value is None else value for value in values], float)


def interval(values: np.ndarray) -> tuple[float, float]:
    """Of the mean over scenes, 95 %."""
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = intervals(np.nanmean(values[drawn], axis=1))
    return float(low), float(high)


def shown(name: str, values: np.ndarray) -> str:
    """Mean and interval."""
    if np.isnan(values).all():
        return ""
    low, high = interval(values)
    if name in COUNTS:
        return f"{np.nanmean(values):.2f} ({low:.2f} to {high:.2f})"
    return f"{100 * np.nanmean(values):.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tour", type=int, default=0, help="steps")
    parser.add_argument("--perturb", nargs="+", default=["none"])
    parser.add_argument("--alone", action="store_true", help="without the other agents")
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    generalist = Generalist.shipped()
    rivals = {CARELESS: replace(generalist, settings=replace(generalist.settings, collision_cost=0.0))}
    if args.tour:
        rivals[RETRIEVAL] = Retrieving(generalist.encoder, generalist.sight, generalist.settings)
    asked = {"goals": args.goals, "seed": args.seed, "tour": args.tour, "perturb": args.perturb}
    found: dict[str, GoalEvaluation] = {}
    for name, agent in {"generalist": generalist, **({} if args.alone else rivals)}.items():
        own, *others = clearway.evaluate_goals(agent, args.scenes, **asked)
        found |= {name: own} | {other.agent: other for other in others}
    print("| " + " | ".join(("agent", *SHOWN)) + " |\n|" + "---|" * (len(SHOWN) + 1))
    for name, evaluation in found.items():
        print("| " + " | ".join((name, *(shown(figure, column(evaluation, figure)) for figure in SHOWN))) + " |")
    own = found["generalist"]
    print(f"\n{own.average.episodes} episodes in {len(own.scenes)} scenes; tour: {own.tour}")
    if CARELESS in found:
        fewer = column(found[CARELESS], "collisions") - column(own, "collisions")
        print(f"collisions spared an episode: {shown('collisions', fewer)}")
    if args.json:
        record = {"asked": asked, "versions": package_versions(), "hardware": hardware()}
        args.json.write_text(json.dumps({**record, **{name: one.to_json() for name, one in found.items()}}) + "\n")


if __name__ == "__main__":
    main()
