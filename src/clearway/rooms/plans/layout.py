"""Where the walls, the furniture and the thin partitions of a floor plan's room stand. Pure geometry, no MuJoCo.

A rim of blocked cells is added at one or both ends of each axis, so that furniture stands along those walls and the
others are bare. A blocked area that is open to the border and wide (OUTSIDE_M) is not part of the room: walls go round
it. Every other blocked cell is covered by furniture, every blocked edge by a thin partition.

Nothing comes nearer to the middle of a free cell than GAP beyond that cell's border, except partitions, which stand on
the border. Room coordinates: x and y, y is the plan's z; the floor starts at (0, 0). Map indices: i along x, j along z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from clearway.rooms.frame import Frame
from clearway.rooms.plans.rectangles import Box, cut, rectangles
from clearway.rooms.shell import SIDES, Column
from clearway.scenes.floor_plans import FloorPlan

GAP = 0.2  # cells
PARTITION_THICKNESS = 0.1  # cells
PARTITION_HEIGHT_M = 1.15
JOINT_M = 0.01  # between a piece of furniture and the next one
RIM_M = 0.5  # depth of the furniture along a wall beyond the plan
OUTSIDE_M = 1.5
PIECE_DEPTH_M = 1.5  # shorter side of a piece, at most
PIECE_LENGTHS_M = (0.6, 2.0)  # longer side

STEPS = {"south": (0, -1), "north": (0, 1), "west": (-1, 0), "east": (1, 0)}  # (i, j)
OPPOSITE = {"south": "north", "north": "south", "west": "east", "east": "west"}
FREE, OUTSIDE = -1, -2  # owners of cells that no piece covers


@dataclass(frozen=True)
class Piece:
    """A place for a piece of furniture.

    Attributes:
        at: the middle of its footprint; its front, the side with most free cells, is at +y.
        width_m, depth_m: full size along the frame's x and y.
        back_at_wall: a wall is behind all of it.
    """

    at: Frame
    width_m: float
    depth_m: float
    back_at_wall: bool


@dataclass(frozen=True)
class Stretch:
    """A straight stretch of wall.

    Attributes:
        at: its middle on the floor, facing the room.
        length_m: how long it is.
        piece: number of the piece that stands before it; None where there are free cells.
        outer: it is one of the room's four walls.
    """

    at: Frame
    length_m: float
    piece: int | None
    outer: bool


@dataclass(frozen=True, eq=False)
class Layout:
    """Where everything stands.

    Attributes:
        width_m, depth_m: size of the floor.
        origin_m: x and z on the plan of the floor's corner (0, 0).
        cell_size_m: of the plan.
        first_cell: x and z of the map's cell (0, 0), in the plan's numbers.
        free: (X, Z) bool map with its rim, the cells that can be entered.
        walls: solid parts inside the floor's rectangle, up to the ceiling.
        partitions: on the blocked edges.
        pieces: of furniture.
        stretches: of wall.
    """

    width_m: float
    depth_m: float
    origin_m: tuple[float, float]
    cell_size_m: float
    first_cell: tuple[int, int]
    free: np.ndarray
    walls: tuple[Column, ...]
    partitions: tuple[Column, ...]
    pieces: tuple[Piece, ...]
    stretches: tuple[Stretch, ...]

    def middles_m(self, cells: np.ndarray) -> np.ndarray:
        """Room coordinates of the middles of cells of the map, (C, 2) both."""
        return (cells + 0.5 + GAP) * self.cell_size_m


def lay_out(plan: FloorPlan, rng: np.random.Generator) -> Layout:
    """Where everything stands in the room of a plan; the generator chooses the walls with furniture and its lengths."""
    size_m = plan.cell_size_m
    free, first_cell = _map_with_rim(plan, rng)
    outside = _outside(free, _cells(OUTSIDE_M, size_m, 2))
    shortest, longest = (_cells(length_m, size_m, 1) for length_m in PIECE_LENGTHS_M)
    boxes = [
        part
        for box in rectangles(~free & ~outside, _cells(PIECE_DEPTH_M, size_m, 1))
        for part in cut(box, shortest, longest, rng)
    ]
    owners = np.where(free, FREE, OUTSIDE)
    for number, (i0, j0, i1, j1) in enumerate(boxes):
        owners[i0:i1, j0:j1] = number
    width_m, depth_m = (_line_m(count, size_m) + GAP * size_m for count in free.shape)
    x_m, z_m = ((cell - 0.5 - GAP) * size_m for cell in first_cell)
    blocked_edges = plan.blocked_edges.astype(np.int64) - np.array(first_cell)
    return Layout(
        width_m=width_m,
        depth_m=depth_m,
        origin_m=(x_m, z_m),
        cell_size_m=size_m,
        first_cell=first_cell,
        free=free,
        walls=_walls(free, outside, size_m),
        partitions=tuple(_partition(one, other, size_m) for one, other in blocked_edges),
        pieces=tuple(_piece(box, owners, size_m) for box in boxes),
        stretches=_stretches(owners, size_m),
    )


def _cells(length_m: float, size_m: float, least: int) -> int:
    return max(least, round(length_m / size_m))


def _line_m(number: float, size_m: float) -> float:
    """Room coordinate of the border before cell `number`."""
    return (number + GAP) * size_m


def _map_with_rim(plan: FloorPlan, rng: np.random.Generator) -> tuple[np.ndarray, tuple[int, int]]:
    """The free cells of the map (bool), and the plan's numbers of its first cell."""
    cells = plan.cells.astype(np.int64)
    low = cells.min(axis=0)
    inside = np.zeros(cells.max(axis=0) - low + 1, bool)
    inside[tuple((cells - low).T)] = True
    rim = _cells(RIM_M, plan.cell_size_m, 1)
    ends = ((rim, 0), (0, rim), (rim, rim))
    before_after = [ends[int(rng.integers(len(ends)))] for _ in range(2)]
    (x, _), (z, _) = before_after
    return np.pad(inside, before_after), (int(low[0]) - x, int(low[1]) - z)


def _outside(free: np.ndarray, width: int) -> np.ndarray:
    """Blocked cells that are not part of the room: areas of squares of that width which reach the map's border."""
    wide = ndimage.binary_opening(~free, np.ones((width, width), bool))
    parts, _ = ndimage.label(wide)
    at_border = np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]])
    return wide & np.isin(parts, at_border[at_border > 0])


def _walls(free: np.ndarray, outside: np.ndarray, size_m: float) -> tuple[Column, ...]:
    """Solid rectangles over the outside, GAP away from every free cell; at the border they reach the room's walls."""
    lines_m = [_sub_lines_m(count, size_m) for count in free.shape]
    beside = np.pad(free, 1)
    near = np.zeros([3 * count for count in free.shape], bool)
    for a in range(3):
        for b in range(3):
            reach = beside.copy()
            for di, dj in {(a - 1, 0), (0, b - 1), (a - 1, b - 1)}:
                reach |= np.roll(beside, (-di, -dj), axis=(0, 1))
            near[a::3, b::3] = reach[1:-1, 1:-1]
    solid = np.repeat(np.repeat(outside, 3, axis=0), 3, axis=1) & ~near
    x_m, y_m = lines_m
    boxes = rectangles(solid, max(solid.shape))
    return tuple(Column(x_m[i0], y_m[j0], x_m[i1], y_m[j1]) for i0, j0, i1, j1 in boxes)


def _sub_lines_m(count: int, size_m: float) -> list[float]:
    """Borders of the three parts of each cell, the outer ones GAP wide, and the last border; ends are the room's."""
    lines_m = [_line_m(number + share, size_m) for number in range(count) for share in (0.0, GAP, 1 - GAP)]
    return [0.0, *lines_m[1:], _line_m(count, size_m) + GAP * size_m]


def _partition(one: np.ndarray, other: np.ndarray, size_m: float) -> Column:
    """A thin low wall on the border of two neighbouring cells, as long as a cell."""
    x_m, y_m = (_line_m((a + b + 1) / 2, size_m) for a, b in zip(one.tolist(), other.tolist(), strict=True))
    thin, long = PARTITION_THICKNESS * size_m / 2, size_m / 2
    half_x, half_y = (thin, long) if one[1] == other[1] else (long, thin)
    return Column(x_m - half_x, y_m - half_y, x_m + half_x, y_m + half_y, PARTITION_HEIGHT_M)


def _piece(box: Box, owners: np.ndarray, size_m: float) -> Piece:
    """The piece over a box of cells, drawn in from its sides so that nothing touches."""
    beyond = {side: _beyond(box, owners, side) for side in SIDES}
    free = {side: int((cells == FREE).sum()) for side, cells in beyond.items()}
    walled = {side: bool((cells == OUTSIDE).all()) for side, cells in beyond.items()}
    at_rest = next((side for side in SIDES if walled[side]), "south")
    front = max(SIDES, key=lambda side: (free[side], side == OPPOSITE[at_rest]))
    i0, j0, i1, j1 = box
    lines = {"west": i0, "south": j0, "east": i1, "north": j1}
    edge_m = {}
    for side, line in lines.items():
        inwards = 1 if side in ("west", "south") else -1
        last = owners.shape[0 if side in ("west", "east") else 1]
        if walled[side]:
            by_m = -GAP * size_m if line in (0, last) else 0.0
        else:
            by_m = GAP * size_m if free[side] else JOINT_M
        edge_m[side] = _line_m(line, size_m) + inwards * by_m
    x_m, y_m = (edge_m["west"] + edge_m["east"]) / 2, (edge_m["south"] + edge_m["north"]) / 2
    along_x_m, along_y_m = edge_m["east"] - edge_m["west"], edge_m["north"] - edge_m["south"]
    if front in ("west", "east"):
        along_x_m, along_y_m = along_y_m, along_x_m
    return Piece(Frame(x_m, y_m, _yaw_deg(front)), along_x_m, along_y_m, walled[OPPOSITE[front]])


def _beyond(box: Box, owners: np.ndarray, side: str) -> np.ndarray:
    """Owners of the cells along one side of a box, just beyond it; beyond the map is outside."""
    i0, j0, i1, j1 = box
    around = np.pad(owners, 1, constant_values=OUTSIDE)
    return {
        "west": around[i0, j0 + 1 : j1 + 1],
        "east": around[i1 + 1, j0 + 1 : j1 + 1],
        "south": around[i0 + 1 : i1 + 1, j0],
        "north": around[i0 + 1 : i1 + 1, j1 + 1],
    }[side]


def _yaw_deg(side: str) -> float:
    """Turn of a frame whose +y points to that side."""
    return {"north": 0.0, "west": 90.0, "south": 180.0, "east": -90.0}[side]


def _stretches(owners: np.ndarray, size_m: float) -> tuple[Stretch, ...]:
    """The straight stretches of wall that cells of the room look at, each before one piece or before free cells."""
    around = np.pad(owners, 1, constant_values=OUTSIDE)
    found = []
    for side, (di, dj) in STEPS.items():
        ahead = np.roll(around, (-di, -dj), axis=(0, 1))[1:-1, 1:-1]
        facing = np.where((ahead == OUTSIDE) & (owners != OUTSIDE), owners, OUTSIDE)
        rows = facing if side in ("west", "east") else facing.T  # [across, along]
        for across, row in enumerate(rows):
            for start, end, owner in _runs(row):
                line = across + (1 if side in ("north", "east") else 0)
                outer = line in (0, len(rows))
                back = GAP if outer or owner == FREE else 0.0
                wall_m = (line + GAP + (back if side in ("north", "east") else -back)) * size_m
                middle_m = _line_m((start + end) / 2, size_m)
                x_m, y_m = (wall_m, middle_m) if side in ("west", "east") else (middle_m, wall_m)
                piece = None if owner == FREE else owner
                frame = Frame(x_m, y_m, _yaw_deg(OPPOSITE[side]))
                found.append(Stretch(frame, (end - start) * size_m, piece, outer))
    return tuple(found)


def _runs(row: np.ndarray) -> list[tuple[int, int, int]]:
    """Start, end and owner of the runs of one owner in a row, but for what is outside."""
    marks = np.flatnonzero(np.diff(row)) + 1
    starts, ends = [0, *marks.tolist()], [*marks.tolist(), len(row)]
    return [(a, b, int(row[a])) for a, b in zip(starts, ends, strict=True) if row[a] != OUTSIDE]
