"""The lattice: poses a step and a quarter turn apart, around the pose in which a walk began.

Axes: 4 headings (0 as at the beginning, then a quarter turn to the right each), G rows (ahead at the beginning),
G columns (to the right at the beginning).
"""

from __future__ import annotations

import numpy as np

from clearway.perception.around import PLACES_M
from clearway.perception.whereabouts import BIN_M, FARTHEST, bin_of

HEADINGS = 4
STEP_M = BIN_M
AHEAD = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
"""(4, 2), rows and columns of a step ahead."""
RIGHT = np.roll(AHEAD, -1, axis=0)
"""(4, 2), of a step to the right."""


def window_bins() -> np.ndarray:
    """(4, 4, W, W) int64, W = 2 * FARTHEST + 1: seen from a pose of each heading, bins of the poses around it.

    The second axis is their heading on the lattice; rows and columns count from `FARTHEST` before the pose.
    """
    offsets = np.arange(-FARTHEST, FARTHEST + 1)
    rows, columns = np.meshgrid(offsets, offsets, indexing="ij")
    found = np.empty((HEADINGS, HEADINGS, *rows.shape), np.int64)
    for heading in range(HEADINGS):
        ahead = rows * AHEAD[heading, 0] + columns * AHEAD[heading, 1]
        right = rows * RIGHT[heading, 0] + columns * RIGHT[heading, 1]
        for other in range(HEADINGS):
            turn_deg = np.full(rows.shape, (other - heading) % HEADINGS * 90.0)
            found[heading, other] = bin_of(ahead * STEP_M, right * STEP_M, turn_deg)
    return found


def places_around() -> np.ndarray:
    """(4, 63, 2) int64: rows and columns of `around.PLACES_M`, counted from a body of each heading."""
    steps = np.rint(np.array(PLACES_M) / STEP_M).astype(np.int64)
    return np.stack([steps[:, :1] * AHEAD[h] + steps[:, 1:] * RIGHT[h] for h in range(HEADINGS)])
