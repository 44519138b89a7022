"""Trained agents that are bound to no room, in rooms that they have never entered, and how they differ.

    python benchmarks/walkers.py rooms-test rec-aware rec-shortest rec-forgets --json record.json

The first run is compared with every other, scene by scene: SPL, and collisions spared. All walk to the same goals from
the same starts.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from by_scene import print_difference, print_table, write_record

import clearway
from clearway.evaluation.goals import GoalEvaluation
from clearway.learn.provenance import hardware, package_versions


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene that is walked in")
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    files = sorted(args.scenes.glob("*.h5"))[args.first :]
    asked = {"goals": args.goals, "seed": args.seed}
    found: dict[str, GoalEvaluation] = {}
    for run in args.runs:
        own, *beside = clearway.evaluate_goals(clearway.load_agent(run), files, **asked)
        found |= {run.name: own} | {other.agent: other for other in beside}
    print_table(found)
    first, *others = (run.name for run in args.runs)
    for other in others:
        print_difference(found[first], found[other], "spl", f"{first}'s SPL above {other}'s")
        print_difference(found[other], found[first], "collisions", f"collisions that {first} spares beside {other}")
    if args.json:
        record = {"asked": asked, "versions": package_versions(), "hardware": hardware()}
        runs = {run.name: json.loads((run / "run.json").read_text())["learner"] for run in args.runs}
        write_record(args.json, {**record, "learners": runs}, found)


if __name__ == "__main__":
    main()
