"""Bins of relative poses: where another camera stands, and how it is turned, as far as that needs to be told.

A bin is half a metre ahead by half a metre to the right by 45 degrees; the first is around the pose of the camera that
looks. The last bin is for all that is farther than four metres ahead, behind or aside.
"""

from __future__ import annotations

import numpy as np

BIN_M, FARTHEST = 0.5, 8  # size of a bin, and bins to each side of the middle
SIDE = 2 * FARTHEST + 1
TURNS = 8
ELSEWHERE = SIDE * SIDE * TURNS
WHEREABOUTS = ELSEWHERE + 1
"""Number of bins."""


def bin_of(ahead_m: np.ndarray, right_m: np.ndarray, turn_deg: np.ndarray) -> np.ndarray:
    """Bins (...,) int64 of relative poses: metres ahead and to the right, degrees turned to the right."""
    ahead, right = (np.rint(way_m / BIN_M).astype(np.int64) for way_m in (ahead_m, right_m))
    turn = np.rint(turn_deg / (360 / TURNS)).astype(np.int64) % TURNS
    inside = (np.abs(ahead) <= FARTHEST) & (np.abs(right) <= FARTHEST)
    return np.where(inside, ((ahead + FARTHEST) * SIDE + right + FARTHEST) * TURNS + turn, ELSEWHERE)
