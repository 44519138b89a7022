"""The lattice: poses a step and a quarter turn apart, around the pose in which a walk began.

Axes: 4 headings (0 as at the beginning, then a quarter turn to the right each), G rows (ahead at the beginning),
G columns (to the right at the beginning).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from clearway.perception.around import AHEAD_M, PLACE_M, PLACES_M, RIGHT_M
from clearway.perception.whereabouts import BIN_M, FARTHEST, bin_of

HEADINGS = 4
HARDLY_M = 1e-6
AHEAD = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
"""(4, 2), rows and columns of a step ahead."""
RIGHT = np.roll(AHEAD, -1, axis=0)
"""(4, 2), of a step to the right."""


@dataclass(frozen=True)
class Lattice:
    """What the length of a step makes of what eyes tell in metres.

    Attributes:
        step_m: between neighbouring cells.
    """

    step_m: float

    @cached_property
    def reach(self) -> int:
        """Cells to each side of a pose of which eyes tell whether something is there."""
        return int(FARTHEST * BIN_M / self.step_m + 1e-9)

    @cached_property
    def window(self) -> np.ndarray:
        """(4, C, 4, W, W) int64, W = 2 * reach + 1: seen from a pose of each heading, bins of the poses around it.

        The third axis is their heading on the lattice; rows and columns count from `reach` before the pose. What is
        told of a pose is the mean over the C bins that it is nearest to.
        """
        offsets = np.arange(-self.reach, self.reach + 1)
        rows, columns = np.meshgrid(offsets, offsets, indexing="ij")
        found = []
        turn_deg = np.arange(HEADINGS)[:, None, None] * 90.0
        for heading in range(HEADINGS):
            ahead = rows * AHEAD[heading, 0] + columns * AHEAD[heading, 1]
            right = rows * RIGHT[heading, 0] + columns * RIGHT[heading, 1]
            found.append(nearest_bins(ahead * self.step_m, right * self.step_m, turn_deg - heading * 90.0))
        count = max(map(len, found))
        return np.stack([np.broadcast_to(bins, (count, *bins.shape[1:])) for bins in found])

    @cached_property
    def around(self) -> np.ndarray:
        """(4, N, 2) int64: rows and columns of the cells among `around.PLACES_M`, from a body of each heading."""
        steps = self._steps_around
        return np.stack([steps[:, :1] * AHEAD[h] + steps[:, 1:] * RIGHT[h] for h in range(HEADINGS)])

    @cached_property
    def shares(self) -> np.ndarray:
        """(N, 63) float32: how much of what is told of each place is told of each cell around, bilinearly."""
        cells = self._steps_around[:, None] * self.step_m
        near = np.maximum(0, 1 - np.abs(cells - np.array(PLACES_M)) / PLACE_M).prod(axis=2)
        return near.astype(np.float32)

    @cached_property
    def next_ahead(self) -> np.ndarray:
        """(N,) bool: which cell around is the next one, straight ahead; none where that is no place of the eyes."""
        return (self._steps_around == (1, 0)).all(axis=1) & (self.step_m == PLACE_M)

    @cached_property
    def _steps_around(self) -> np.ndarray:
        """(N, 2) int64, steps ahead and to the right of the cells among `around.PLACES_M`."""
        ahead, right = int(AHEAD_M[-1] / self.step_m + 1e-9), int(RIGHT_M[-1] / self.step_m + 1e-9)
        return np.array([(a, r) for a in range(ahead + 1) for r in range(-right, right + 1)])


def nearest_bins(ahead_m: np.ndarray, right_m: np.ndarray, turn_deg: np.ndarray) -> np.ndarray:
    """(C, ...) int64, the bins that relative poses are nearest to; C is 1 where none lies between two bins."""
    found: list[np.ndarray] = []
    for ahead, right in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        bins = bin_of(ahead_m + ahead * HARDLY_M, right_m + right * HARDLY_M, turn_deg)
        if not any(np.array_equal(bins, other) for other in found):
            found.append(bins)
    return np.stack(found)


lattice_of = cache(Lattice)
"""The lattice of a step; its tables are made once."""
