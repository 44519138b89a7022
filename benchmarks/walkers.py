"""Trained agents that are bound to no room, in rooms that they have never entered.

    python benchmarks/walkers.py rooms-test aware-0 aware-1 shortest-0 shortest-1 --json record.json
    python benchmarks/walkers_judged.py record.json --fewer aware shortest

The name of a run is its kind, a hyphen and its seed. All walk to the same goals from the same starts. With
`--trying-again KIND` its agents walk once more, as KIND-again, and may try again what was blocked where they see the
same picture.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from by_scene import print_table, write_record

import clearway
from clearway.evaluation.goals import GoalEvaluation
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.recurrent import TrainedRecurrent


def kind_and_seed(name: str) -> tuple[str, str]:
    """Of a run, by its folder's name."""
    kind, _, seed = name.rpartition("-")
    return kind, seed


def learnt(runs: Sequence[Path]) -> dict[str, dict[str, Any]]:
    """By name of folder, what each run was trained by, for how long, and as what its record has it.

    Raises:
        SystemExit: a folder is called by another seed, or as another one is.
    """
    names = [run.name for run in runs]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise SystemExit(f"{', '.join(twice)}: given twice. Rename one folder of each name")
    found = {run.name: _learnt(run) for run in runs}
    for name, about in found.items():
        if kind_and_seed(name)[1] != str(about["seed"]):
            raise SystemExit(f"{name}: was trained with seed {about['seed']}. Call the folder KIND-{about['seed']}")
    return found


def _learnt(run: Path) -> dict[str, Any]:
    record = json.loads((run / "run.json").read_text())
    *_, last = (run / "metrics.jsonl").read_text().splitlines()
    end = json.loads(last)
    told = {name: record[name] for name in ("learner", "reward", "seed")}
    return {**told, "scenes": len(record["scenes"]), "frames": end["frames"], "seconds": round(end["seconds"])}


def main() -> None:
    """Measure, write the record, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene that is walked in")
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--perturb", nargs="+", default=["none"])
    parser.add_argument("--trying-again", metavar="KIND", help="whose agents walk once more")
    parser.add_argument("--json", type=Path, help="where the record is written, after each agent")
    args = parser.parse_args()
    kinds = {kind_and_seed(run.name)[0] for run in args.runs}
    if args.trying_again and args.trying_again not in kinds:
        parser.error(f"--trying-again {args.trying_again}: the runs are of {', '.join(sorted(kinds))}")
    files = sorted(args.scenes.glob("*.h5"))[args.first :]
    asked = {"goals": args.goals, "seed": args.seed, "perturb": args.perturb}
    runs = learnt(args.runs)
    record = {"asked": asked, "versions": package_versions(), "hardware": hardware(), "runs": runs}
    found: dict[str, GoalEvaluation] = {}
    for run in args.runs:
        agent = clearway.load_agent(run)
        assert isinstance(agent, TrainedRecurrent), run
        own, *beside = clearway.evaluate_goals(agent, files, **asked)
        found |= {run.name: own} | {other.agent: other for other in beside}
        kind, seed = kind_and_seed(run.name)
        if kind == args.trying_again:
            again = replace(agent, tries_again=True)
            found[f"{kind}-again-{seed}"] = clearway.evaluate_goals(again, files, **asked)[0]
        if args.json:
            write_record(args.json, record, found)
    print_table(found)


if __name__ == "__main__":
    main()
