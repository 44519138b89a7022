"""Trained agents that are bound to no room, in rooms that they have never entered.

    python benchmarks/walkers.py rooms-test aware-0 aware-1 shortest-0 shortest-1 --json record.json
    python benchmarks/walkers_judged.py record.json --fewer aware shortest

The name of a run is its kind, a hyphen and its seed. All walk to the same goals from the same starts. With
`--trying-again KIND` its agents walk once more, as KIND-again, and may try again what was blocked where they see the
same picture.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from by_scene import print_table, write_record
from run_names import kind_and_seed, learnt

import clearway
from clearway.evaluation.goals import GoalEvaluation
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.recurrent import TrainedRecurrent


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
