"""The walls inside a floor plan's room: solid columns, their faces, and the doorways in them. Pure geometry, no MuJoCo.

Each cell is cut in three along both axes, its outer parts GAP wide: a wall keeps GAP from the cells beside it. Map
indices: i along x, j along z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from clearway.rooms.frame import Frame
from clearway.rooms.plans.cell_map import CellMap, Opening
from clearway.rooms.plans.rectangles import rectangles
from clearway.rooms.shell import Column, Face

GAP = 0.2  # cells
DOOR_HEIGHT_M = 2.05
LINING_M = 0.04  # thickness of a doorway's jambs and head
YAWS_DEG = {"north": 0.0, "west": 90.0, "south": 180.0, "east": -90.0}  # of a frame whose +y points to that side
STEPS = {"south": (0, -1), "north": (0, 1), "west": (-1, 0), "east": (1, 0)}  # (i, j)
AIR, SOLID, LINTEL, SHELL = range(4)


@dataclass(frozen=True)
class Doorway:
    """An opening in a wall, up to DOOR_HEIGHT_M.

    Attributes:
        at: the middle of its floor; one walks through along y.
        width_m: between the walls at its sides.
        depth_m: thickness of the wall.
    """

    at: Frame
    width_m: float
    depth_m: float


def line_m(number: float, size_m: float) -> float:
    """Room coordinate of the border before cell `number`."""
    return (number + GAP) * size_m


def sub_lines_m(count: int, size_m: float) -> list[float]:
    """Borders of the three parts of each cell, the outer ones GAP wide, and the last border; ends are the room's."""
    lines_m = [line_m(number + share, size_m) for number in range(count) for share in (0.0, GAP, 1 - GAP)]
    return [0.0, *lines_m[1:], line_m(count, size_m) + GAP * size_m]


def solid_parts(solid: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Which thirds of (X, Z) cells are wall, (3 X, 3 Z) bool: solid ones, GAP away from every cell of `beside`."""
    around = np.pad(beside, 1)
    near = np.zeros([3 * count for count in solid.shape], bool)
    for a in range(3):
        for b in range(3):
            reach = around.copy()
            for di, dj in {(a - 1, 0), (0, b - 1), (a - 1, b - 1)}:
                reach |= np.roll(around, (-di, -dj), axis=(0, 1))
            near[a::3, b::3] = reach[1:-1, 1:-1]
    return np.repeat(np.repeat(solid, 3, axis=0), 3, axis=1) & ~near


def columns_of(parts: np.ndarray, size_m: float) -> tuple[Column, ...]:
    """The walls as rectangles; at the border of the map they reach the room's walls."""
    x_m, y_m = (sub_lines_m(count // 3, size_m) for count in parts.shape)
    boxes = rectangles(parts, max(parts.shape))
    return tuple(Column(x_m[i0], y_m[j0], x_m[i1], y_m[j1]) for i0, j0, i1, j1 in boxes)


def doorways_of(cells: CellMap, size_m: float) -> tuple[Doorway, ...]:
    """The doorways of a map."""
    return tuple(_doorway(opening, size_m) for opening in cells.openings)


def _doorway(opening: Opening, size_m: float) -> Doorway:
    i0, j0, i1, j1 = opening.box
    middle = Frame(line_m((i0 + i1) / 2, size_m), line_m((j0 + j1) / 2, size_m), 0.0 if opening.along_x else 90.0)
    wide, deep = (i1 - i0, j1 - j0) if opening.along_x else (j1 - j0, i1 - i0)
    return Doorway(middle, (wide + 2 * GAP) * size_m, (deep - 2 * GAP) * size_m)


def faces_of(cells: CellMap, parts: np.ndarray, size_m: float, *, under_ceiling: bool = False) -> tuple[Face, ...]:
    """The faces of the walls, each as long as it goes straight on, and those above the doors.

    Args:
        cells: the map.
        parts: `solid_parts` of it.
        size_m: side of a cell.
        under_ceiling: as they are there, where they go straight on over the doors.
    """
    kinds = np.pad(np.where(parts, SOLID, AIR), 1, constant_values=SHELL)
    for opening in cells.openings:
        i0, j0, i1, j1 = (3 * line + 1 for line in opening.box)  # the map has been padded
        i_in, j_in = (-1, 1) if opening.along_x else (1, -1)  # up to the walls at its sides, and as deep as they are
        lintel = kinds[i0 + i_in : i1 - i_in, j0 + j_in : j1 - j_in]
        lintel[lintel == AIR] = SOLID if under_ceiling else LINTEL
    lines_m = [sub_lines_m(count // 3, size_m) for count in parts.shape]
    return tuple(face for side in STEPS for face in _faces_to(side, kinds, lines_m))


def _faces_to(side: str, kinds: np.ndarray, lines_m: Sequence[Sequence[float]]) -> list[Face]:
    """The faces that look to one side."""
    di, dj = STEPS[side]
    ahead = np.roll(kinds, (-di, -dj), axis=(0, 1))
    shows = np.where((ahead == AIR) & ((kinds == SOLID) | (kinds == LINTEL)), kinds, AIR)
    along_x = side in ("south", "north")
    if along_x:
        kinds, ahead, shows = kinds.T, ahead.T, shows.T
    across_m, along_m = (lines_m[1], lines_m[0]) if along_x else (lines_m[0], lines_m[1])
    found = []
    for across in range(1, shows.shape[0] - 1):
        row = shows[across]
        marks = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
        for start, end in pairwise(marks):
            if row[start] == AIR:
                continue
            low_m, high_m = along_m[start - 1], along_m[end - 1]
            wall_m = across_m[across - 1 if side in ("south", "west") else across]
            x_m, y_m = ((low_m + high_m) / 2, wall_m) if along_x else (wall_m, (low_m + high_m) / 2)
            ends = [_end(kinds[across, beyond], ahead[across, beyond], along_x) for beyond in (start - 1, end)]
            at = Frame(x_m, y_m, YAWS_DEG[side])
            if side in ("south", "east"):  # their x points to lower coordinates
                ends.reverse()
            bottom_m = DOOR_HEIGHT_M + LINING_M if row[start] == LINTEL else 0.0
            found.append(Face(at, high_m - low_m, bottom_m, (ends[0], ends[1])))
    return found


def _end(beside: int, before: int, along_x: bool) -> int:
    """How a board along a face ends, see `Face`: boards along x cover the ends of those along y."""
    if before == SHELL or (before == SOLID and not along_x):  # an inner corner
        return -1
    return 1 if before == beside == AIR and along_x else 0
