"""Trained agents that are bound to no room, in rooms that they have never entered, and how kinds of them differ.

    python benchmarks/walkers.py rooms-test aware-0 aware-1 shortest-0 shortest-1 --fewer aware shortest

The name of a run is its kind, a hyphen and its seed. All walk to the same goals from the same starts. A claim about two
kinds compares the means over seeds, room by room: it holds where the interval over rooms leaves out zero, after
correction for all claims of that figure (Holm), and every seed says the same of the two kinds. With `--trying-again
KIND` its agents walk once more, as KIND-again, and may try again what was blocked where they see the same picture.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from by_scene import column, p_of_mean, print_table, shown, write_record

import clearway
import clearway.agents.recurrent
from clearway.evaluation.goals import GoalEvaluation
from clearway.experiments.correction import LEVEL, holm
from clearway.learn.provenance import hardware, package_versions


@dataclass(frozen=True)
class Judged:
    """By how much a figure of one kind is above that of another.

    Args:
        by_seed: (seeds, scenes) differences.
        p: two-sided, corrected for all claims.
        holds: the claim that it is above.
    """

    by_seed: np.ndarray
    p: float
    holds: bool


def judged(kinds: Mapping[str, np.ndarray], claims: Sequence[tuple[str, str]]) -> list[Judged]:
    """What is held of claims that the first kind is above the second, by figures (seeds, scenes) of kinds."""
    differences = [kinds[above] - kinds[below] for above, below in claims]
    corrected = holm([p_of_mean(by_seed.mean(axis=0)) for by_seed in differences])
    return [
        Judged(by_seed, p, bool(p <= LEVEL and (by_seed.mean(axis=1) > 0).all()))
        for by_seed, p in zip(differences, corrected, strict=True)
    ]


def by_kind(found: Mapping[str, GoalEvaluation], runs: Sequence[str], name: str) -> dict[str, np.ndarray]:
    """(seeds, scenes) a figure of the agents of each kind, seeds in order."""
    kinds = {run.rpartition("-")[0] for run in runs}
    return {
        kind: np.array([column(found[run], name) for run in sorted(runs) if run.rpartition("-")[0] == kind])
        for kind in kinds
    }


def print_judged(found: Mapping[str, GoalEvaluation], runs: Sequence[str], name: str, claims: list[list[str]]) -> None:
    """A line a claim."""
    pairs = [(above, below) for above, below in claims]
    for (above, below), claim in zip(pairs, judged(by_kind(found, runs, name), pairs), strict=True):
        seeds = ", ".join(f"{mean:.3g}" for mean in claim.by_seed.mean(axis=1))
        held = "holds" if claim.holds else "does not hold"
        print(f"{name}, {above} above {below}: {shown(name, claim.by_seed.mean(axis=0))}; by seed {seeds}; ", end="")
        print(f"p = {claim.p:.2g}: {held}")


@contextmanager
def trying_again() -> Iterator[None]:
    """Agents keep their probabilities, whatever was blocked."""
    kept = clearway.agents.recurrent.without_blocked
    clearway.agents.recurrent.without_blocked = lambda state, mark, probabilities: probabilities
    try:
        yield
    finally:
        clearway.agents.recurrent.without_blocked = kept


def main() -> None:
    """Measure, print, judge, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene that is walked in")
    parser.add_argument("--goals", type=int, default=20, help="of each scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fewer", nargs=2, action="append", default=[], metavar="KIND", help="collisions: the first's")
    parser.add_argument("--higher", nargs=2, action="append", default=[], metavar="KIND", help="SPL: the first's")
    parser.add_argument("--trying-again", metavar="KIND", help="whose agents walk once more")
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    files = sorted(args.scenes.glob("*.h5"))[args.first :]
    asked = {"goals": args.goals, "seed": args.seed}
    found: dict[str, GoalEvaluation] = {}
    for run in args.runs:
        own, *beside = clearway.evaluate_goals(clearway.load_agent(run), files, **asked)
        found |= {run.name: own} | {other.agent: other for other in beside}
    runs = [run.name for run in args.runs]
    for run in args.runs:
        kind, _, seed = run.name.rpartition("-")
        if kind == args.trying_again:
            runs.append(f"{kind}-again-{seed}")
            with trying_again():
                found[runs[-1]] = clearway.evaluate_goals(clearway.load_agent(run), files, **asked)[0]
    print_table(found)
    print_judged(found, runs, "collisions", [[other, kind] for kind, other in args.fewer])
    print_judged(found, runs, "spl", args.higher)
    if args.json:
        record = {"asked": asked, "versions": package_versions(), "hardware": hardware()}
        learners = {run.name: json.loads((run / "run.json").read_text())["learner"] for run in args.runs}
        write_record(args.json, {**record, "learners": learners}, found)


if __name__ == "__main__":
    main()
