"""Statistics over rooms: every room tells two kinds of agents apart by a ratio, and rooms are the chance.

Rooms differ in size, so that figures of one kind differ by more from room to room than two kinds do in one. Their ratio
in a room does not. Its mean over rooms is the geometric one.

Axis letters: K rooms.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.evaluation.across_seeds import RESAMPLES, Estimate, mean_estimate

EXACT_ROOMS = 16
"""Of so many rooms all 2^K ways to change signs are gone through; of more, `RESAMPLES` are drawn."""


def ratio_estimate(first: np.ndarray, second: np.ndarray) -> Estimate:
    """How many times the second kind's figure the first kind's is: the geometric mean over rooms, with its interval.

    The interval is a bootstrap's over rooms, expanded as those over seeds are.

    Args:
        first: (K,), above 0.
        second: (K,), above 0, of the same rooms.
    """
    logs = np.log(first / second)
    found = mean_estimate(logs[:, None], np.zeros(1, np.int64))
    ends = None if found.interval is None else (math.exp(found.interval[0]), math.exp(found.interval[1]))
    return Estimate(math.exp(found.value), ends)


def sign_flip_p(first: np.ndarray, second: np.ndarray, allowed: float = 1.0) -> float:
    """How often chance alone makes the mean ratio differ from `allowed` as much as it does, two-sided.

    By a permutation test: if the kinds were alike, each room's log ratio could as well have the other sign. Exact up
    to 16 rooms. Of six rooms it is 3.1 % at least, of ten 0.2 %.

    Args:
        first: (K,), above 0.
        second: (K,), above 0, of the same rooms.
        allowed: the ratio that counts as equal.
    """
    logs = np.log(first / (second * allowed))
    count = len(logs)
    if count <= EXACT_ROOMS:
        bits = (np.arange(2**count)[:, None] >> np.arange(count)) & 1
        signs = 1 - 2 * bits  # as they are, first
    else:
        drawn = np.random.default_rng(0).integers(2, size=(RESAMPLES, count))
        signs = np.vstack([np.ones(count, np.int64), 1 - 2 * drawn])
    means = signs @ logs
    return float((np.abs(means) >= abs(means[0]) - 1e-12 * np.abs(logs).sum()).mean())
