"""Two sets of trainings judged together: is one reward's figure lower than the other's, in both?

    python benchmarks/records.py unpack docs/records/paper-bathroom.tar.xz paper
    python benchmarks/records.py unpack docs/records/zones-or-step-bathroom.tar.xz zones
    python benchmarks/both_sets.py paper zones

Exact permutation test, stratified: runs change places within their set alone. A set's difference of means is divided by
its standard deviation over all permutations, and the two are added. Nothing of this was registered.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import numpy as np

from clearway.experiments.convergence import frames_until_settled, mark_steps
from clearway.experiments.groups import PAIR, compared
from clearway.experiments.reproduce import gather

FIGURES = (
    "collisions",
    "collisions at the worst target",
    "frames until settled",
    "steps",
    "share of steps in the zone",
)


def figures(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """By reward and figure, (R,): a value a run of the published settings."""
    setting = gather(folder).setting
    world, mark = setting.world(), mark_steps(setting, setting.targets)
    found = {}
    for group in (group for group in compared(setting, PAIR) if group.learner == "paper"):
        own = group.scores(setting.out, world.target_count)
        values = (
            own.of("collisions").mean(1),
            own.of("collisions").max(1),
            frames_until_settled(setting.out, group, mark)[0][:, 0],
            own.of("steps").mean(1),
            own.of("share_collision").mean(1),
        )
        found[group.agent] = dict(zip(FIGURES, values, strict=True))
    return found


def differences(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(P,) differences of means, in units of their standard deviation, of all ways to deal runs out."""
    values = np.concatenate([first, second])
    dealt = np.array(list(itertools.combinations(range(len(values)), len(first))))  # (P, R), first as they are
    means = values[dealt].mean(1)
    others = (values.sum() - means * len(first)) / len(second)
    return (means - others) / (means - others).std()


def stratified_p(pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Two-sided, exact: of two pairs of kinds of runs."""
    one, other = (differences(*pair) for pair in pairs)
    together = one[:, None] + other[None, :]
    return float((np.abs(together) >= abs(together[0, 0]) - 1e-9).mean())


def _text(value: float) -> str:
    """To four digits; frames whole."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.4g}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs=2)
    sets = [figures(folder) for folder in parser.parse_args().folders]
    shortest, aware = (reward.name for reward in PAIR)
    print(f"| {aware}, {shortest} | first set | second set | p of both |\n|---|---|---|---|")
    for figure in FIGURES:
        pairs = [(own[aware][figure], own[shortest][figure]) for own in sets]
        means = (", ".join(_text(kind.mean()) for kind in pair) for pair in pairs)
        print(f"| {figure} | {' | '.join(means)} | {stratified_p(pairs):.2g} |")


if __name__ == "__main__":
    main()
