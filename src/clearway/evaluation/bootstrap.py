"""Percentile bootstrap (Efron & Tibshirani 1993, ch. 13), stratified: targets are redrawn one by one.

The interval speaks about the episodes (starts, chances) of one trained agent, not about other training seeds.

Axis letters: N episodes, J metrics, M targets, R resamples.
"""

from __future__ import annotations

import numpy as np

RESAMPLES = 2000
LEVEL = 0.95


def resampled_by_target(
    numerator: np.ndarray,
    denominator: np.ndarray,
    target: np.ndarray,
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> np.ndarray:
    """Every metric of every target on resampled episodes, (R, M, J) float64.

    Args:
        numerator: (N, J) float64.
        denominator: (N, J) float64; a metric is the sum of the numerators by the sum of the denominators.
        target: (N,) int, target of each episode; every target occurs.
        resamples: R.
        seed: the same seed gives the same resamples.
    """
    rng = np.random.default_rng(seed)
    values = np.empty((resamples, int(target.max()) + 1, numerator.shape[1]))
    for index in range(values.shape[1]):
        own = np.flatnonzero(target == index)
        times_drawn = rng.multinomial(len(own), np.full(len(own), 1 / len(own)), size=resamples)  # (R, episodes)
        values[:, index] = (times_drawn @ numerator[own]) / (times_drawn @ denominator[own])
    return values


def intervals(resampled: np.ndarray, level: float = LEVEL) -> np.ndarray:
    """The middle `level` of the resamples: (R, ...) -> (2, ...), lower and upper end."""
    outside = (1 - level) / 2
    return np.quantile(resampled, [outside, 1 - outside], axis=0)
