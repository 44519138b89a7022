"""Claims about kinds of walkers, judged from a record of `walkers`: one call judges the claims of one question.

    python benchmarks/walkers_judged.py record.json --fewer aware shortest --fewer aware bump
    python benchmarks/walkers_judged.py record.json --higher aware shortest

`--fewer A B` claims that agents of kind A have fewer collisions than those of kind B, `--higher A B` a higher SPL.
Means over seeds are compared room by room. A claim holds where p is 5 % at most, after correction for all claims of the
call (Holm), and every seed says so. Rooms are drawn anew, seeds are not: it is a claim about these agents. Beside it
stands an interval, not corrected, for which seeds of both kinds are drawn anew, too.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from by_scene import p_of_mean, shown

from clearway.evaluation.bootstrap import RESAMPLES, intervals
from clearway.experiments.correction import LEVEL, holm


@dataclass(frozen=True)
class Judged:
    """By how much a figure of one kind is above that of another.

    Args:
        by_seed: (seeds, scenes) differences.
        p: two-sided, corrected for all claims.
        holds: the claim that it is above.
        other_seeds: ends of the interval for which seeds are drawn anew, too.
    """

    by_seed: np.ndarray
    p: float
    holds: bool
    other_seeds: tuple[float, float]


def of_kind(record: Mapping[str, Any], kind: str, figure: str) -> dict[str, dict[str, float]]:
    """A figure of the agents of a kind, by seed and scene. Raises SystemExit: the record has none."""
    found = {}
    for name, evaluation in record.items():
        named, _, seed = name.rpartition("-")
        if named == kind:
            found[seed] = {scene["scene"]: scene[figure] for scene in evaluation["scenes"]}
    if not found:
        raise SystemExit(f"{kind}: no run of this kind in the record. It has {', '.join(record)}")
    return found


def paired(record: Mapping[str, Any], figure: str, above: str, below: str) -> tuple[np.ndarray, np.ndarray]:
    """A figure of two kinds, each (seeds, scenes), the same of both in order.

    Raises:
        SystemExit: they have other seeds or scenes.
    """
    one, other = of_kind(record, above, figure), of_kind(record, below, figure)
    if one.keys() != other.keys():
        told = f"seeds {', '.join(sorted(one))} and {', '.join(sorted(other))}"
        raise SystemExit(f"{above} and {below}: {told}. Compare the same seeds of each")
    scenes = list(next(iter(one.values())))
    if any(run.keys() != set(scenes) for run in (*one.values(), *other.values())):
        raise SystemExit(f"{above} and {below}: they walked in other scenes. Compare walks in the same")
    seeds = sorted(one)
    first, second = (np.array([[kind[seed][scene] for scene in scenes] for seed in seeds]) for kind in (one, other))
    return first, second


def with_other_seeds(above: np.ndarray, below: np.ndarray) -> tuple[float, float]:
    """95 % of the difference of means of two kinds (seeds, scenes), seeds of each and scenes of both drawn anew."""
    rng = np.random.default_rng(0)
    means = []
    for _ in range(RESAMPLES):
        scenes = rng.integers(above.shape[1], size=above.shape[1])
        one, other = (kind[rng.integers(len(kind), size=len(kind))].mean(axis=0)[scenes] for kind in (above, below))
        means.append((one - other).mean())
    low, high = intervals(np.array(means))
    return float(low), float(high)


def judged(record: Mapping[str, Any], figure: str, claims: Sequence[tuple[str, str]]) -> list[Judged]:
    """What is held of claims that a figure of the first kind is above that of the second."""
    pairs = [paired(record, figure, above, below) for above, below in claims]
    corrected = holm([p_of_mean((above - below).mean(axis=0)) for above, below in pairs])
    return [
        Judged(
            above - below,
            p,
            bool(p <= LEVEL and ((above - below).mean(axis=1) > 0).all()),
            with_other_seeds(above, below),
        )
        for (above, below), p in zip(pairs, corrected, strict=True)
    ]


def main() -> None:
    """Judge and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("record", type=Path)
    parser.add_argument("--fewer", nargs=2, action="append", metavar="KIND", help="the first has fewer collisions")
    parser.add_argument("--higher", nargs=2, action="append", metavar="KIND", help="the first has a higher SPL")
    args = parser.parse_args()
    if bool(args.fewer) == bool(args.higher):
        parser.error("ask either for --fewer or for --higher: each call is one question")
    record = json.loads(args.record.read_text())
    figure, claims = ("spl", args.higher) if args.higher else ("collisions", [pair[::-1] for pair in args.fewer])
    for (above, below), claim in zip(claims, judged(record, figure, claims), strict=True):
        seeds = ", ".join(f"{mean:.3g}" for mean in claim.by_seed.mean(axis=1))
        held = "holds" if claim.holds else "does not hold"
        print(f"{figure}, {above} above {below}: {held}; p = {claim.p:.2g} (Holm, {len(claims)} claims)")
        low, high = claim.other_seeds
        print(f"  {shown(figure, claim.by_seed.mean(axis=0))} over rooms; by seed {seeds}", end="")
        print(f"; over rooms and seeds {low:.3g} to {high:.3g}")


if __name__ == "__main__":
    main()
