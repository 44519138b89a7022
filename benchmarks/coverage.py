"""How far the statistics over runs can be trusted: intervals that hold the mean, and claims told apart by chance.

    python benchmarks/coverage.py

Runs are drawn from distributions whose mean is known: normal, skewed, and with one run in ten far off.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

import numpy as np

from clearway.evaluation.across_seeds import difference, mean_estimate, permutation_p

ONE = np.zeros(1, np.int64)
RESAMPLES = 2_000  # of the interval's 20,000, for speed
FAR = 10.0  # standard deviations
Draw = Callable[[np.random.Generator, int], np.ndarray]


def _normal(rng: np.random.Generator, runs: int) -> np.ndarray:
    return rng.normal(size=(runs, 1))


def _skewed(rng: np.random.Generator, runs: int) -> np.ndarray:
    return rng.lognormal(0, 1, (runs, 1)) - math.exp(0.5)


def _far(rng: np.random.Generator, runs: int) -> np.ndarray:
    return rng.normal(size=(runs, 1)) + FAR * ((rng.random((runs, 1)) < 0.1) - 0.1)


NARROW = 0.1  # standard deviations
DRAWS: dict[str, Draw] = {"normal": _normal, "lognormal, sigma 1": _skewed, "one run in ten 10 sd off": _far}
"""Scores of runs, (R, 1), whose mean is 0."""


def _holds_zero(interval: tuple[float, float] | None) -> bool:
    assert interval is not None, "there are several runs"
    return interval[0] <= 0 <= interval[1]


def shares(draw: Draw, runs: int, times: int) -> tuple[float, float, float]:
    """How often the mean's interval holds it, that of a difference of two alike kinds 0, and p is at most 5 %."""
    rng = np.random.default_rng(0)
    means = [mean_estimate(draw(rng, runs), ONE, resamples=RESAMPLES) for _ in range(times)]
    pairs = [(draw(rng, runs), draw(rng, runs)) for _ in range(times)]
    apart = [difference(one, other, ONE, resamples=RESAMPLES) for one, other in pairs]
    return (
        float(np.mean([_holds_zero(own.interval) for own in means])),
        float(np.mean([_holds_zero(own.interval) for own in apart])),
        float(np.mean([permutation_p(one, other, ONE) <= 0.05 for one, other in pairs])),
    )


def beside_a_narrow_kind(draw: Draw, runs: int, times: int) -> tuple[float, float]:
    """As the last two of `shares`, where the other kind has the same mean and hardly varies."""
    rng = np.random.default_rng(2)
    pairs = [(NARROW * _normal(rng, runs), draw(rng, runs)) for _ in range(times)]
    apart = [difference(one, other, ONE, resamples=RESAMPLES) for one, other in pairs]
    return (
        float(np.mean([_holds_zero(own.interval) for own in apart])),
        float(np.mean([permutation_p(one, other, ONE) <= 0.05 for one, other in pairs])),
    )


def size_of_same_runs(correlation: float, runs: int, times: int) -> float:
    """How often p is at most 5 % where two alike kinds are the same runs twice, of so correlated scores."""
    rng = np.random.default_rng(1)
    spread = np.array([[1.0, correlation], [correlation, 1.0]])
    found = [rng.multivariate_normal(np.zeros(2), spread, runs) for _ in range(times)]
    return float(np.mean([permutation_p(own[:, :1], own[:, 1:], ONE) <= 0.05 for own in found]))


def main() -> None:
    """Print two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--times", type=int, default=2_000)
    args = parser.parse_args()
    alike, narrow = ("a difference's holds 0", "p <= 5 %"), ("the same beside a narrow kind", "p <= 5 %")
    print(f"{args.runs} runs a kind", "the mean's interval holds it", *alike, *narrow, sep=" | ")
    for name, draw in DRAWS.items():
        found = (*shares(draw, args.runs, args.times), *beside_a_narrow_kind(draw, args.runs, args.times))
        print(name, *(f"{100 * share:.0f} %" for share in found), sep=" | ")
    print("the same runs twice, correlation | p <= 5 %")
    for correlation in (-0.5, 0.0, 0.5, 0.8):
        print(f"{correlation} | {100 * size_of_same_runs(correlation, args.runs, args.times):.1f} %")


if __name__ == "__main__":
    main()
