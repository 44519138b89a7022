"""Statistics over training seeds, so that no claim rests on one run (Agarwal et al., NeurIPS 2021).

A score is one figure of one target from one run. Targets are the fixed tasks, runs the chance. One run learns all its
targets together, so runs are redrawn whole; redrawing every target's runs by themselves would take 5 runs of 5 targets
for 25 independent ones.

Intervals are expanded percentile intervals of the bootstrap (Hesterberg, The American Statistician 69(4), 2015): a
percentile interval of few runs is too narrow, so its level is raised as Student's t and n / (n - 1) ask for. Of
5 runs with normal scores it holds the mean in 91 % of all cases, the difference of two alike means in 96 %; other
scores `benchmarks/coverage.py` tries.

Axis letters: R runs, one a seed, M targets, C scenes, B resamples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np

from clearway.evaluation.bootstrap import LEVEL

RESAMPLES = 20_000
MOST_DIVISIONS = 200_000
"""Of runs that can be divided in so many ways all are gone through, as of 10 and 10; of more, `RESAMPLES` are drawn."""
ROUNDED = 12  # decimals, of shares of the largest score


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval; the interval is None where there is one seed alone."""

    value: float
    interval: tuple[float, float] | None

    def __str__(self) -> str:
        """To three significant digits, with the interval."""
        return _text(self.value) if self.ends is None else f"{_text(self.value)} [{self.ends}]"

    def __neg__(self) -> Estimate:
        """Of the figure with the other sign."""
        return Estimate(-self.value, None if self.interval is None else (-self.interval[1], -self.interval[0]))

    @property
    def ends(self) -> str | None:
        """The interval alone, to three significant digits."""
        return None if self.interval is None else " to ".join(map(_text, self.interval))


def mean_estimate(scores: np.ndarray, target_scene: np.ndarray, *, resamples: int = RESAMPLES) -> Estimate:
    """The plain mean over scenes of the means over their targets and all runs.

    Args:
        scores: (R, M).
        target_scene: (M,) int, scene of each target.
        resamples: B.
    """
    own = scores @ _weights(target_scene)
    return Estimate(float(own.mean()), _interval(own[_redrawn(len(own), resamples, 0)].mean(1), len(own)))


def difference(
    first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, resamples: int = RESAMPLES
) -> Estimate:
    """By how much the mean of the first kind exceeds that of the second, see `mean_estimate`; arguments as below."""
    own = _centred(first, second, target_scene)
    means = [runs[_redrawn(len(runs), resamples, seed)].mean(1) for seed, runs in enumerate(own)]
    value = float(own[0].mean() - own[1].mean())
    return Estimate(value, _interval(means[0] - means[1], min(len(first), len(second))))


def probability_of_less(
    first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, resamples: int = RESAMPLES
) -> Estimate:
    """The probability of improvement: that a run of the first kind scores less on a target than one of the second.

    Mean over scenes of the means over targets of P(first < second) + P(first = second) / 2 over all pairs of runs, as
    Agarwal et al. define it. Where a few targets go the other way in every run, it stays below 1 however sure it is.

    Args:
        first: (R, M).
        second: (R', M).
        target_scene: (M,) int.
        resamples: B.
    """
    less = 0.5 + np.sign(second[None] - first[:, None]) / 2  # (R, R', M)
    pairs = less @ _weights(target_scene)
    rows, columns = (_redrawn(len(runs), resamples, seed) for seed, runs in enumerate((first, second)))
    drawn = pairs[rows[:, :, None], columns[:, None, :]].mean((1, 2))
    return Estimate(float(pairs.mean()), _interval(drawn, min(len(first), len(second))))


def permutation_p(first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, allowed: float = 0.0) -> float:
    """How often chance alone tells two kinds of runs apart as much as they are, two-sided.

    Over all ways to divide the runs anew, or 20,000 drawn ones where there are over 200,000, by Welch's statistic,
    which does not ask for equal spread (Janssen, Statistics & Probability Letters 36(1), 1997). Of 5 and 5 runs it is
    0.8 % at least, of 4 and 4 2.9 %. Runs are taken for independent, also where some are the same ones at another time.

    Args:
        first: (R, M).
        second: (R', M).
        target_scene: (M,) int.
        allowed: by which the first may exceed the second and still count as equal.
    """
    count, runs = len(first), np.concatenate(_centred(first, second, target_scene, allowed))
    if math.comb(len(runs), count) <= MOST_DIVISIONS:
        chosen = _divisions(len(runs), count)
    else:
        rng = np.random.default_rng(0)
        chosen = np.stack([np.arange(count), *(rng.permutation(len(runs))[:count] for _ in range(RESAMPLES))])
    one = np.zeros((len(chosen), len(runs)), bool)
    np.put_along_axis(one, chosen, True, axis=1)
    statistic = _welch(runs, one)  # of the runs as they are, first
    return float((np.abs(statistic) >= abs(statistic[0]) * (1 - 1e-9)).mean())


def _centred(first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, allowed: float = 0.0) -> list[np.ndarray]:
    """Means of the runs of both kinds, (R,) and (R',), less the mean of all; the first less what is allowed, too.

    Runs that are equal are so to the last bit: what rounding leaves between them would be told for a difference.
    """
    weights = _weights(target_scene)
    own = [first @ weights - allowed, second @ weights]
    size = max(abs(allowed), *(float(np.abs(scores).max(initial=0.0)) for scores in (first, second))) or 1.0
    middle = np.concatenate(own).mean()
    return [np.round((means - middle) / size, ROUNDED) * size for means in own]


@cache
def _divisions(runs: int, count: int) -> np.ndarray:
    """(D, count) int16: the runs of the first kind in each way to divide them, as they are first."""
    return np.array(list(combinations(range(runs), count)), np.int16)


def _welch(runs: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Welch's statistic of runs (R,) for each division (D, R) bool into one kind and the other."""
    means, errors = [], np.zeros(len(one))
    for kind in (one, ~one):
        count = kind.sum(axis=1)
        means.append((kind @ runs) / count)
        spread = (kind * (runs - means[-1][:, None]) ** 2).sum(axis=1)
        errors += spread / (count * np.maximum(count - 1, 1))
    return (means[0] - means[1]) / np.sqrt(np.maximum(errors, np.finfo(float).tiny))


def failed_targets(success: np.ndarray) -> str:
    """Of the targets of all runs, how many some episode failed, for example "3 of 25"; success (R, M)."""
    return f"{int((success < 1).sum())} of {success.size}"


def _text(value: float) -> str:
    """To three significant digits, never with an exponent that hides thousands."""
    return f"{value:,.0f}" if abs(value) >= 999.5 else f"{value:.3g}"


def _redrawn(runs: int, resamples: int, seed: int) -> np.ndarray:
    """(B, R) int: which runs each resample holds."""
    return np.random.default_rng(seed).integers(runs, size=(resamples, runs))


def _weights(target_scene: np.ndarray) -> np.ndarray:
    """(M,) weight of each target, so that scenes count alike."""
    count = np.bincount(target_scene)
    return 1 / (count[target_scene] * np.count_nonzero(count))


def _interval(drawn: np.ndarray, runs: int) -> tuple[float, float] | None:
    """The expanded percentile interval of a bootstrap's means (B,) from so many runs; None where there is one."""
    if runs < 2:
        return None
    from scipy import special

    student = special.stdtrit(runs - 1, (1 + LEVEL) / 2)
    tail = special.ndtr(-math.sqrt(runs / (runs - 1)) * student)
    low, high = np.quantile(drawn, [tail, 1 - tail])
    return float(low), float(high)
