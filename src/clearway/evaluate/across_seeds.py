"""Statistics over training seeds, so that no claim rests on one run (Agarwal et al., NeurIPS 2021).

A score is one figure of one target from one seed. Intervals are stratified bootstraps: seeds are redrawn for every
target by itself, since targets are the fixed tasks and seeds the chance.

Axis letters: R seeds, M targets, C scenes, B resamples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.evaluate.bootstrap import RESAMPLES, intervals


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval; the interval is None where there is one seed alone."""

    value: float
    interval: tuple[float, float] | None

    def __str__(self) -> str:
        """To three significant digits, with the interval."""
        if self.interval is None:
            return f"{self.value:.3g}"
        low, high = self.interval
        return f"{self.value:.3g} [{low:.3g}, {high:.3g}]"

    def __neg__(self) -> Estimate:
        """Of the figure with the other sign."""
        return Estimate(-self.value, None if self.interval is None else (-self.interval[1], -self.interval[0]))

    @property
    def ends(self) -> str | None:
        """The interval alone, to three significant digits."""
        return None if self.interval is None else f"{self.interval[0]:.3g} - {self.interval[1]:.3g}"


def mean_estimate(scores: np.ndarray, target_scene: np.ndarray, *, resamples: int = RESAMPLES) -> Estimate:
    """The plain mean over scenes of the means over their targets and all seeds.

    Args:
        scores: (R, M).
        target_scene: (M,) int, scene of each target.
        resamples: B.
    """
    weights = _weights(target_scene)
    drawn = _resampled(scores, resamples, np.random.default_rng(0)).mean(1) @ weights
    return Estimate(float(scores.mean(0) @ weights), _ends(drawn, len(scores)))


def difference(
    first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, resamples: int = RESAMPLES
) -> Estimate:
    """By how much the mean of the first kind exceeds that of the second, see `mean_estimate`; arguments as below."""
    rng, weights = np.random.default_rng(0), _weights(target_scene)
    drawn = [_resampled(scores, resamples, rng).mean(1) @ weights for scores in (first, second)]
    value = float((first.mean(0) - second.mean(0)) @ weights)
    return Estimate(value, _ends(drawn[0] - drawn[1], min(len(first), len(second))))


def probability_of_less(
    first: np.ndarray, second: np.ndarray, target_scene: np.ndarray, *, resamples: int = RESAMPLES
) -> Estimate:
    """The probability that a run of the first kind scores less than one of the second, a tie counting half.

    Mean over scenes of the means over targets of P(first < second) + P(first = second) / 2 over all pairs of seeds.

    Args:
        first: (R, M).
        second: (R', M).
        target_scene: (M,) int.
        resamples: B.
    """
    rng, weights = np.random.default_rng(0), _weights(target_scene)
    drawn = _less(_resampled(first, resamples, rng), _resampled(second, resamples, rng)) @ weights
    value = float((_less(first[None], second[None]) @ weights)[0])
    return Estimate(value, _ends(drawn, min(len(first), len(second))))


def _less(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(B, R, M), (B, R', M) -> (B, M)."""
    pairs = np.sign(second[:, None] - first[:, :, None])  # (B, R, R', M)
    return (0.5 + pairs / 2).mean((1, 2))


def _resampled(scores: np.ndarray, resamples: int, rng: np.random.Generator) -> np.ndarray:
    """(R, M) -> (B, R, M), seeds redrawn target by target."""
    seeds, targets = scores.shape
    index = rng.integers(seeds, size=(resamples, seeds, targets))
    return scores[index, np.arange(targets)]


def _weights(target_scene: np.ndarray) -> np.ndarray:
    """(M,) weight of each target, so that scenes count alike."""
    count = np.bincount(target_scene)
    return 1 / (count[target_scene] * np.count_nonzero(count))


def _ends(drawn: np.ndarray, seeds: int) -> tuple[float, float] | None:
    if seeds < 2:
        return None
    low, high = intervals(drawn)
    return float(low), float(high)
