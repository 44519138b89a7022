"""How well frozen features tell the states of a scene apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BLOCK_STATES = 1024  # rows of the (S, S) similarities that are in memory at a time


@dataclass(frozen=True)
class FeatureSpread:
    """Two measures of how much a set of features can tell apart.

    Attributes:
        effective_rank: exp of the entropy of the variance shares of the principal components (Roy and
            Vetterli 2007 with squared singular values): in how many directions the states differ.
        closest_cosine_distance: 1 - cosine similarity of the two most alike states; 0 means that an agent
            cannot tell them apart.
        closest_states: the ids of these two states.
    """

    effective_rank: float
    closest_cosine_distance: float
    closest_states: tuple[int, int]


def feature_spread(features: np.ndarray) -> FeatureSpread:
    """Measure features (S, F), at least two states. Costs O(S^2 F): a second for a thousand states."""
    assert features.ndim == 2 and len(features) >= 2, features.shape
    distance, states = _closest_pair(features.astype(np.float32))
    return FeatureSpread(_effective_rank(features.astype(np.float64)), distance, states)


def _effective_rank(features: np.ndarray) -> float:
    centred = features - features.mean(axis=0)
    small = centred @ centred.T if len(centred) < centred.shape[1] else centred.T @ centred
    variances = np.clip(np.linalg.eigvalsh(small), 0, None)
    if variances.sum() == 0:
        return 0.0  # all states alike
    shares = variances / variances.sum()
    shares = shares[shares > 0]
    return float(np.exp(-(shares * np.log(shares)).sum()))


def _closest_pair(features: np.ndarray) -> tuple[float, tuple[int, int]]:
    lengths = np.linalg.norm(features, axis=1, keepdims=True)
    directions = features / np.where(lengths > 0, lengths, 1)
    best, pair = -np.inf, (0, 1)
    for start in range(0, len(directions), BLOCK_STATES):
        rows = directions[start : start + BLOCK_STATES]
        similarity = rows @ directions.T
        similarity[np.arange(len(rows)), start + np.arange(len(rows))] = -np.inf
        row, column = np.unravel_index(similarity.argmax(), similarity.shape)
        if similarity[row, column] > best:
            best, pair = float(similarity[row, column]), (start + int(row), int(column))
    return max(0.0, 1 - best), (min(pair), max(pair))
