"""What every cell of a plan with walls is: free, wall or furniture, where its doors are, which room it lies in.

Needs no MuJoCo. Map indices: i along x, j along z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from clearway.errors import SceneError
from clearway.rooms.plans.rectangles import Box
from clearway.scenes.floor_plans import FloorPlan

OUTSIDE_M = 1.5


@dataclass(frozen=True)
class Opening:
    """Door cells side by side that are one opening in a wall.

    Attributes:
        box: its cells.
        along_x: the wall runs along x, so that one walks through along z.
    """

    box: Box
    along_x: bool


@dataclass(frozen=True, eq=False)
class CellMap:
    """A plan with walls as a map. Rows and columns at its border that are nothing but wall are left out.

    Attributes:
        first_cell: x and z of the map's cell (0, 0), in the plan's numbers.
        free: (X, Z) bool, cells that can be entered.
        solid: (X, Z) bool, wall up to the ceiling; what is neither is furniture.
        openings: the doors.
        rooms: (X, Z) int, number from 1 of the room that a free cell lies in, door cells aside; 0 elsewhere.
    """

    first_cell: tuple[int, int]
    free: np.ndarray
    solid: np.ndarray
    openings: tuple[Opening, ...]
    rooms: np.ndarray


def check_doors(plan: FloorPlan) -> None:
    """Raises SceneError where a door of a plan is in no wall."""
    if plan.has_walls:
        cell_map(plan)


def cell_map(plan: FloorPlan) -> CellMap:
    """The map of a plan with walls.

    Blocked cells are furniture where they can be seen: those that no free cell looks at are solid, and so are wide ones
    that reach the border of the map where it has no wall (`outside`).

    Raises:
        SceneError: a door is in no wall.
    """
    everything = np.concatenate([plan.cells, plan.walls]).astype(np.int64)
    low = everything.min(axis=0)
    free, walls, doors = (_marked(cells, low, everything) for cells in (plan.cells, plan.walls, plan.doors))
    blocked = ~free & ~walls
    solid = walls | _unseen(blocked, free) | outside(blocked, cells_of(OUTSIDE_M, plan.cell_size_m, 2))
    kept = tuple(_inner(solid.all(axis=1 - axis)) for axis in range(2))
    first = (int(low[0]) + kept[0].start, int(low[1]) + kept[1].start)
    free, solid, doors = free[kept], solid[kept], doors[kept]
    rooms, _ = ndimage.label(free & ~doors)
    return CellMap(first, free, solid, _openings(plan, first, free, solid, doors), rooms)


def cells_of(length_m: float, size_m: float, least: int) -> int:
    """Cells in a length, rounded."""
    return max(least, round(length_m / size_m))


def outside(blocked: np.ndarray, width: int) -> np.ndarray:
    """Blocked cells that are not part of the room: areas of squares of that width which reach the map's border."""
    wide = ndimage.binary_opening(blocked, np.ones((width, width), bool))
    parts, _ = ndimage.label(wide)
    at_border = np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]])
    return wide & np.isin(parts, at_border[at_border > 0])


def _marked(cells: np.ndarray, low: np.ndarray, everything: np.ndarray) -> np.ndarray:
    """The map (X, Z) bool of some cells."""
    marked = np.zeros(everything.max(axis=0) - low + 1, bool)
    marked[tuple((cells.astype(np.int64) - low).T)] = True
    return marked


def _unseen(blocked: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Areas of blocked cells beside which nothing is free."""
    parts, _ = ndimage.label(blocked)
    seen = np.unique(parts[ndimage.binary_dilation(free)])
    return blocked & ~np.isin(parts, seen)


def _inner(all_solid: np.ndarray) -> slice:
    """The lines between the first and the last that are not solid all along."""
    open_lines = np.flatnonzero(~all_solid)
    return slice(int(open_lines[0]), int(open_lines[-1]) + 1)


def _openings(
    plan: FloorPlan, first: tuple[int, int], free: np.ndarray, solid: np.ndarray, doors: np.ndarray
) -> tuple[Opening, ...]:
    """The doors as openings, each with the way its wall runs; beyond the map is wall."""
    labels, _ = ndimage.label(doors)
    around, ways = np.pad(solid, 1, constant_values=True), np.pad(free, 1)
    found = []
    for columns, rows in ndimage.find_objects(labels):
        i0, i1, j0, j1 = columns.start, columns.stop, rows.start, rows.stop
        beside_x = [np.s_[i0, j0 + 1 : j1 + 1], np.s_[i1 + 1, j0 + 1 : j1 + 1]]
        beside_z = [np.s_[i0 + 1 : i1 + 1, j0], np.s_[i0 + 1 : i1 + 1, j1 + 1]]
        in_wall = [all(around[side].all() for side in sides) for sides in (beside_x, beside_z)]
        if not any(in_wall) or not doors[columns, rows].all():
            i, j = np.argwhere(doors[columns, rows])[0]
            cell = (int(i0 + i + first[0]), int(j0 + j + first[1]))
            problem = f"has a door in the cell {cell} that is in no wall"
            remedy = "Put walls, not furniture, at two opposite sides of it, or make it a free cell"
            raise SceneError(plan.source or plan.name, problem, remedy, plan.dataset)
        along_x, along_z = (
            sum(int(ways[side].sum()) for side in sides) if fits else -1
            for fits, sides in zip(in_wall, (beside_z, beside_x), strict=True)
        )  # cells to walk to through the opening, where its wall runs so
        found.append(Opening((i0, j0, i1, j1), along_x >= along_z))
    return tuple(found)
