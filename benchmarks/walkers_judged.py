"""Claims about kinds of walkers, judged from a record of `walkers`: each call one question, corrected for its claims.

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
from by_scene import shown

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


def of_kind(record: Mapping[str, Any], kind: str, figure: str) -> np.ndarray:
    """(seeds, scenes) a figure of the agents of a kind, seeds in order. Raises SystemExit: the record has none."""
    runs = sorted(name for name in record if name.rpartition("-")[0] == kind)
    if not runs:
        raise SystemExit(f"{kind}: no run of this kind in the record. It has {', '.join(record)}")
    return np.array([[scene[figure] for scene in record[run]["scenes"]] for run in runs])


def p_of_mean(values: np.ndarray) -> float:
    """Two-sided p of a mean over scenes (scenes,) that is zero: twice the share of redrawn means on its other side."""
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    means = values[drawn].mean(axis=1)
    return min(1.0, 2 * (1 + min(int((means <= 0).sum()), int((means >= 0).sum()))) / (RESAMPLES + 1))


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
    pairs = [(of_kind(record, above, figure), of_kind(record, below, figure)) for above, below in claims]
    for (above, below), names in zip(pairs, claims, strict=True):
        if above.shape != below.shape:
            raise SystemExit(f"{' and '.join(names)}: {len(above)} and {len(below)} seeds. Compare as many of each")
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
