"""Beliefs over the poses of a lattice, as logarithms, and what changes them.

Axes: 4 headings, G rows, G columns; W cells along a side of the window around a pose, see `Lattice`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.mapping.lattice import AHEAD, HEADINGS, Lattice

IMPOSSIBLE = -60.0
SEEN = 4.0  # log-odds at most of a cell that was seen, not tried
NO_ROOM = -SEEN - 1  # log-odds below which a body cannot stand in a cell: it was tried
NEXT, NEXT_AT_0 = 0.64, 0.37
"""What is held of the cell next to a body, straight ahead, per log-odds that eyes tell of it, and where these are 0.
What `search` makes of it is how moves into such cells turned out in `validation`, so that both change together. The
last look tells all there: what others told before adds nothing."""
VISIBLE = 0.9  # probability that something would be seen in a cell that is surely free: others may be behind a wall
HALF_SURE = 2.0  # log-odds of a cell at which that is half as much


@dataclass(frozen=True)
class LatticePose:
    """A heading, a row and a column."""

    heading: int
    row: int
    column: int

    @property
    def cell(self) -> tuple[int, int]:
        """Row and column."""
        return self.row, self.column

    @property
    def index(self) -> tuple[int, int, int]:
        """Of the pose in a belief."""
        return self.heading, self.row, self.column

    def moved(self, steps: int) -> LatticePose:
        """So many steps ahead, or back."""
        rows, columns = AHEAD[self.heading] * steps
        return LatticePose(self.heading, self.row + int(rows), self.column + int(columns))

    def turned(self, quarters: int) -> LatticePose:
        """So many quarter turns to the right."""
        return LatticePose((self.heading + quarters) % HEADINGS, self.row, self.column)


def likeliest(belief: np.ndarray) -> LatticePose:
    """The pose with the greatest value (4, G, G), the first among equals."""
    heading, row, column = np.unravel_index(int(belief.argmax()), belief.shape)
    return LatticePose(int(heading), int(row), int(column))


def add_sighting(
    belief: np.ndarray,
    pose: LatticePose,
    evidence: np.ndarray,
    weight: float,
    lattice: Lattice,
    room: np.ndarray | None = None,
    surest: float | None = None,
) -> None:
    """Add evidence (ELSEWHERE,) of where something is, seen from a pose, to a belief (4, G, G) about it.

    What is behind a wall is not seen, so that evidence against a pose is weak there: given log-odds (G, G) that a body
    can stand in the cells, it is log(v exp(evidence) + 1 - v), where v is the probability that the pose would be seen.

    What is alike in a wrong place is alike in many looks, so that they are not independent: evidence for a pose raises
    what is held of it to `surest` times itself at most, however often it comes; None: without end.
    """
    side = belief.shape[-1]
    rows, here_rows = _within(pose.row, side, lattice.reach)
    columns, here_columns = _within(pose.column, side, lattice.reach)
    seen = evidence[lattice.window[pose.heading][..., here_rows, here_columns]].mean(axis=0)
    if room is not None:
        visible = VISIBLE / (1 + np.exp(-2 * (room[rows, columns] - HALF_SURE)))
        seen = np.where(seen > 0, seen, np.log(visible * np.exp(seen) + 1 - visible))
    before = belief[:, rows, columns]
    after = before + weight * seen
    if surest is not None:
        after = np.where(seen > 0, np.maximum(before, np.minimum(after, surest * seen)), after)
    belief[:, rows, columns] = after


def add_standing(
    room: np.ndarray,
    pose: LatticePose,
    evidence: np.ndarray,
    weight: float,
    lattice: Lattice,
    *,
    last_look: bool = False,
) -> None:
    """Add evidence (63,) of where a body could stand, seen from a pose, to log-odds (G, G) of cells not tried yet.

    last_look: of the cell straight ahead it takes the place of what was told before.
    """
    side = len(room)
    rows, columns = (lattice.around[pose.heading] + np.array(pose.cell)).T
    inside = (rows >= 0) & (rows < side) & (columns >= 0) & (columns < side)
    cells = rows[inside], columns[inside]
    before = room[cells]
    told = (lattice.shares @ evidence)[inside]
    seen = before + weight * told
    if last_look:
        seen = np.where(lattice.next_ahead[inside], NEXT_AT_0 + NEXT * told, seen)
    room[cells] = np.where(np.abs(before) > SEEN, before, np.clip(seen, -SEEN, SEEN))


def _within(middle: int, side: int, reach: int) -> tuple[slice, slice]:
    """The part of a window around a place that lies in the lattice, in the lattice and in the window."""
    first, last = max(0, middle - reach), min(side, middle + reach + 1)
    return slice(first, last), slice(first - middle + reach, last - middle + reach)
