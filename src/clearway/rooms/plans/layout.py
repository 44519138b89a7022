"""Where the walls, the furniture and the thin partitions of a floor plan's room stand. Pure geometry, no MuJoCo.

A plan that names its walls is built as it is (`cell_map`): walls, doors and furniture where it says, any furniture on
every other blocked cell that can be seen.

Any other plan gets a rim of blocked cells at one or both ends of each axis, so that furniture stands along those walls
and the others are bare. A blocked area that is open to the border and wide (OUTSIDE_M) is not part of the room: walls
go round it. Every other blocked cell is covered by furniture. Every blocked edge becomes a thin partition.

Nothing comes nearer to the middle of a free cell than GAP beyond that cell's border, except partitions, which stand on
the border. Room coordinates: x and y, y is the plan's z; the floor starts at (0, 0). Map indices: i along x, j along z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from clearway.rooms.frame import Frame
from clearway.rooms.plans.cell_map import OUTSIDE_M, CellMap, cell_map, cells_of, outside
from clearway.rooms.plans.rectangles import Box, cut, rectangles
from clearway.rooms.plans.walls import (
    GAP,
    STEPS,
    YAWS_DEG,
    Doorway,
    columns_of,
    doorways_of,
    faces_of,
    line_m,
    solid_parts,
)
from clearway.rooms.shell import SIDES, Column, Face
from clearway.scenes.floor_plans import Area, FloorPlan, Furnishing

PARTITION_THICKNESS = 0.1  # cells
PARTITION_HEIGHT_M = 1.15
JOINT_M = 0.01  # between a piece of furniture and the next one
RIM_M = 0.5  # depth of the furniture along a wall beyond the plan
PIECE_DEPTH_M = 1.5  # shorter side of a piece, at most
PIECE_LENGTHS_M = (0.6, 2.0)  # longer side
AREA_PARTS = 4
DOOR_FRAME_M = 0.1  # of wall beside a doorway that its frame covers

OPPOSITE = {"south": "north", "north": "south", "west": "east", "east": "west"}
FREE, OUTSIDE = -1, -2  # owners of cells that no piece covers


@dataclass(frozen=True)
class Piece:
    """A place for a piece of furniture.

    Attributes:
        at: the middle of its footprint; its front, the side with most free cells, is at +y.
        width_m, depth_m: full size along the frame's x and y.
        back_at_wall: a wall is behind all of it.
        room: number of the room that it stands in, where the plan has walls; else 0.
        area: of the plan that its middle lies in, if any.
        kind: of furniture that the plan names; None where any will do.
    """

    at: Frame
    width_m: float
    depth_m: float
    back_at_wall: bool
    room: int = 0
    area: Area | None = None
    kind: str | None = None


@dataclass(frozen=True)
class Stretch:
    """A straight stretch of wall.

    Attributes:
        at: its middle on the floor, facing the room.
        length_m: how long it is.
        piece: number of the piece that stands before it; None where there are free cells.
        outer: nothing but wall is behind it.
        room: as of a `Piece`.
        area: of the plan that lies before it, if any.
    """

    at: Frame
    length_m: float
    piece: int | None
    outer: bool
    room: int = 0
    area: Area | None = None


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
        beyond: those of them that are more than a cell away from every room, where the plan says where walls are: what
            is outside of a flat that fills no rectangle.
        partitions: on the blocked edges.
        pieces: of furniture.
        stretches: of wall.
        has_walls: the plan says where walls are.
        rooms: (X, Z) int, number from 1 of the room that a free cell lies in, door cells aside; 0 elsewhere.
        faces: of the walls inside; empty where the plan has none, and the sides of `walls` show.
        cornices: where boards run under the ceiling, along the faces and over the doors.
        doorways: in the walls.
        areas: of the plan.
        area_map: (n X, n Z) int with n = AREA_PARTS, number of the area that is nearest to each part of a cell, so that
            areas meet in the middle of a wall; -1 where there are none.
    """

    width_m: float
    depth_m: float
    origin_m: tuple[float, float]
    cell_size_m: float
    first_cell: tuple[int, int]
    free: np.ndarray
    walls: tuple[Column, ...]
    beyond: tuple[Column, ...]
    partitions: tuple[Column, ...]
    pieces: tuple[Piece, ...]
    stretches: tuple[Stretch, ...]
    has_walls: bool
    rooms: np.ndarray
    faces: tuple[Face, ...]
    cornices: tuple[Face, ...]
    doorways: tuple[Doorway, ...]
    areas: tuple[Area, ...]
    area_map: np.ndarray

    @property
    def has_named_furniture(self) -> bool:
        """Whether the plan names furniture, as generated ones do."""
        return any(piece.kind is not None for piece in self.pieces)

    def area_at(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """The numbers of the areas at places of the floor, see `area_map`."""
        places = zip((x_m, y_m), self.area_map.shape, strict=True)
        i, j = (
            np.clip(((place_m / self.cell_size_m - GAP) * AREA_PARTS).astype(int), 0, count - 1)
            for place_m, count in places
        )
        return self.area_map[i, j]

    def middles_m(self, cells: np.ndarray) -> np.ndarray:
        """Room coordinates of the middles of cells of the map, (C, 2) both."""
        return (cells + 0.5 + GAP) * self.cell_size_m


def lay_out(plan: FloorPlan, rng: np.random.Generator) -> Layout:
    """Where everything stands in the room of a plan; the generator chooses the walls with furniture and its lengths."""
    size_m = plan.cell_size_m
    cells = cell_map(plan) if plan.has_walls else _map_with_rim(plan, rng)
    shortest, longest = (cells_of(length_m, size_m, 1) for length_m in PIECE_LENGTHS_M)
    open_to_choice = ~cells.free & ~cells.solid
    named = _named_boxes(plan, cells)
    for i0, j0, i1, j1 in named:
        open_to_choice[i0:i1, j0:j1] = False
    boxes = [
        part
        for box in rectangles(open_to_choice, cells_of(PIECE_DEPTH_M, size_m, 1))
        for part in cut(box, shortest, longest, rng)
    ] + list(named)
    owners = np.where(cells.free, FREE, OUTSIDE)
    for number, (i0, j0, i1, j1) in enumerate(boxes):
        owners[i0:i1, j0:j1] = number
    width_m, depth_m = (line_m(count, size_m) + GAP * size_m for count in cells.free.shape)
    x_m, z_m = ((cell - 0.5 - GAP) * size_m for cell in cells.first_cell)
    blocked_edges = plan.blocked_edges.astype(np.int64) - np.array(cells.first_cell)
    parts = solid_parts(cells.solid, ~cells.solid if plan.has_walls else cells.free)
    beyond = _beyond_rooms(cells.solid) if plan.has_walls else np.zeros_like(parts)
    walls, far_walls = columns_of(parts & ~beyond, size_m), columns_of(parts & beyond, size_m)
    pieces = tuple(
        replace(
            _piece(box, owners, size_m, plan.has_walls, named[box].front if box in named else None),
            room=_room(box, cells),
            area=_area(box, cells, plan),
            kind=named[box].kind if box in named else None,
        )
        for box in boxes
    )
    return Layout(
        width_m=width_m,
        depth_m=depth_m,
        origin_m=(x_m, z_m),
        cell_size_m=size_m,
        first_cell=cells.first_cell,
        free=cells.free,
        walls=walls + far_walls,
        beyond=far_walls,
        partitions=tuple(_partition(one, other, size_m) for one, other in blocked_edges),
        pieces=pieces,
        stretches=_stretches(cells, owners, pieces, plan),
        has_walls=plan.has_walls,
        rooms=cells.rooms,
        faces=faces_of(cells, parts, size_m) if plan.has_walls else (),
        cornices=faces_of(cells, parts, size_m, under_ceiling=True) if plan.has_walls else (),
        doorways=doorways_of(cells, size_m),
        areas=plan.areas,
        area_map=_area_map(cells, plan),
    )


def _beyond_rooms(solid: np.ndarray) -> np.ndarray:
    """Which thirds of (X, Z) cells, (3 X, 3 Z) bool, are in solid cells that touch no others, not at a corner."""
    touched = ndimage.binary_dilation(~solid, np.ones((3, 3), bool))
    return np.repeat(np.repeat(~touched, 3, axis=0), 3, axis=1)


def _map_with_rim(plan: FloorPlan, rng: np.random.Generator) -> CellMap:
    """The map of a plan without walls; all of it is one room."""
    cells = plan.cells.astype(np.int64)
    low = cells.min(axis=0)
    inside = np.zeros(cells.max(axis=0) - low + 1, bool)
    inside[tuple((cells - low).T)] = True
    rim = cells_of(RIM_M, plan.cell_size_m, 1)
    ends = ((rim, 0), (0, rim), (rim, rim))
    before_after = [ends[int(rng.integers(len(ends)))] for _ in range(2)]
    (x, _), (z, _) = before_after
    free = np.pad(inside, before_after)
    solid = outside(~free, cells_of(OUTSIDE_M, plan.cell_size_m, 2))
    return CellMap((int(low[0]) - x, int(low[1]) - z), free, solid, (), np.zeros(free.shape, int))


def _area_map(cells: CellMap, plan: FloorPlan) -> np.ndarray:
    """The number of the area that is nearest to each part of a cell, see `Layout`."""
    numbers = np.full(cells.free.shape, -1)
    for number, area in reversed(list(enumerate(plan.areas))):
        (i0, j0), (i1, j1) = (np.array(cell) - cells.first_cell for cell in (area.low, area.high))
        numbers[max(i0, 0) : max(i1 + 1, 0), max(j0, 0) : max(j1 + 1, 0)] = number
    numbers = np.repeat(np.repeat(numbers, AREA_PARTS, axis=0), AREA_PARTS, axis=1)
    if (numbers < 0).all():
        return numbers
    i, j = ndimage.distance_transform_edt(numbers < 0, return_distances=False, return_indices=True)
    return numbers[i, j]


def _area(box: Box, cells: CellMap, plan: FloorPlan) -> Area | None:
    """The first area of the plan that the middle of a box of cells lies in."""
    i0, j0, i1, j1 = box
    x, z = (i0 + i1 - 1) / 2 + cells.first_cell[0], (j0 + j1 - 1) / 2 + cells.first_cell[1]
    return next((area for area in plan.areas if _holds(area, x, z)), None)


def _holds(area: Area, x: float, z: float) -> bool:
    return area.low[0] - 0.5 <= x <= area.high[0] + 0.5 and area.low[1] - 0.5 <= z <= area.high[1] + 0.5


def _room(box: Box, cells: CellMap) -> int:
    """The room that most cells beside a box lie in; 0 for none."""
    beside = np.concatenate([_beyond(box, cells.rooms, side) for side in SIDES])
    return int(np.bincount(beside[beside > 0], minlength=1).argmax())


def _partition(one: np.ndarray, other: np.ndarray, size_m: float) -> Column:
    """A thin low wall on the border of two neighbouring cells, as long as a cell."""
    x_m, y_m = (line_m((a + b + 1) / 2, size_m) for a, b in zip(one.tolist(), other.tolist(), strict=True))
    thin, long = PARTITION_THICKNESS * size_m / 2, size_m / 2
    half_x, half_y = (thin, long) if one[1] == other[1] else (long, thin)
    return Column(x_m - half_x, y_m - half_y, x_m + half_x, y_m + half_y, PARTITION_HEIGHT_M)


def _named_boxes(plan: FloorPlan, cells: CellMap) -> dict[Box, Furnishing]:
    """The furniture that a plan with walls names, by its cells on the map; what nobody could see is left out."""
    x, z = cells.first_cell
    boxes = {
        (piece.low[0] - x, piece.low[1] - z, piece.high[0] - x + 1, piece.high[1] - z + 1): piece
        for piece in (plan.furniture if plan.has_walls else ())
    }
    return {
        (i0, j0, i1, j1): piece
        for (i0, j0, i1, j1), piece in boxes.items()
        if min(i0, j0) >= 0 and i1 <= cells.free.shape[0] and j1 <= cells.free.shape[1]
        if not cells.solid[i0:i1, j0:j1].any()
    }


def _piece(box: Box, owners: np.ndarray, size_m: float, to_walls: bool, front: str | None = None) -> Piece:
    """The piece over a box of cells, drawn in so that nothing touches, but drawn out to walls if asked to.

    Without a `front` it looks to where most cells are free.
    """
    beyond = {side: _beyond(box, owners, side) for side in SIDES}
    free = {side: int((cells == FREE).sum()) for side, cells in beyond.items()}
    walled = {side: bool((cells == OUTSIDE).all()) for side, cells in beyond.items()}
    at_rest = next((side for side in SIDES if walled[side]), "south")
    front = front or max(SIDES, key=lambda side: (free[side], side == OPPOSITE[at_rest]))
    i0, j0, i1, j1 = box
    lines = {"west": i0, "south": j0, "east": i1, "north": j1}
    edge_m = {}
    for side, line in lines.items():
        inwards = 1 if side in ("west", "south") else -1
        last = owners.shape[0 if side in ("west", "east") else 1]
        if walled[side]:
            by_m = -GAP * size_m if to_walls or line in (0, last) else 0.0
        else:
            by_m = GAP * size_m if free[side] else JOINT_M
        edge_m[side] = line_m(line, size_m) + inwards * by_m
    x_m, y_m = (edge_m["west"] + edge_m["east"]) / 2, (edge_m["south"] + edge_m["north"]) / 2
    along_x_m, along_y_m = edge_m["east"] - edge_m["west"], edge_m["north"] - edge_m["south"]
    if front in ("west", "east"):
        along_x_m, along_y_m = along_y_m, along_x_m
    return Piece(Frame(x_m, y_m, YAWS_DEG[front]), along_x_m, along_y_m, walled[OPPOSITE[front]])


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


def _stretches(cells: CellMap, owners: np.ndarray, pieces: Sequence[Piece], plan: FloorPlan) -> tuple[Stretch, ...]:
    """The straight stretches of wall that cells of the room look at, each before one piece or before free cells."""
    size_m, walled = plan.cell_size_m, plan.has_walls
    around = np.pad(owners, 1, constant_values=OUTSIDE)
    doors = np.zeros(owners.shape, bool)
    for i0, j0, i1, j1 in (opening.box for opening in cells.openings):
        doors[i0:i1, j0:j1] = True
    found = []
    for side, (di, dj) in STEPS.items():
        ahead = np.roll(around, (-di, -dj), axis=(0, 1))[1:-1, 1:-1]
        facing = np.where((ahead == OUTSIDE) & (owners != OUTSIDE) & ~doors, owners, OUTSIDE)
        across_x = side in ("west", "east")
        rows = facing if across_x else facing.T  # [across, along]
        for across, row in enumerate(rows):
            for start, end, owner in _runs(row):
                line = across + (1 if side in ("north", "east") else 0)
                box = (across, start, across + 1, end) if across_x else (start, across, end, across + 1)
                low_m, high_m = (
                    _wall_ends_m(box, side, high_end, owners, doors, size_m) if walled else 0.0 for high_end in (0, 1)
                )
                outer = line in (0, len(rows)) or (walled and _is_wall_to_the_border(box, side, cells.solid))
                back = GAP if walled or outer or owner == FREE else 0.0
                wall_m = (line + GAP + (back if side in ("north", "east") else -back)) * size_m
                middle_m = line_m((start + end) / 2, size_m) + (low_m - high_m) / 2
                x_m, y_m = (wall_m, middle_m) if across_x else (middle_m, wall_m)
                piece = None if owner == FREE else owner
                frame = Frame(x_m, y_m, YAWS_DEG[OPPOSITE[side]])
                room = int(cells.rooms[box[0], box[1]]) if piece is None else pieces[piece].room
                length_m = (end - start) * size_m - low_m - high_m
                found.append(Stretch(frame, length_m, piece, outer, room, _area(box, cells, plan)))
    return tuple(found)


def _ahead(box: Box, side: str) -> Box:
    """The cells ahead of a box, as deep as it is."""
    i0, j0, i1, j1 = box
    di, dj = STEPS[side]
    return i0 + di * (i1 - i0), j0 + dj * (j1 - j0), i1 + di * (i1 - i0), j1 + dj * (j1 - j0)


def _is_wall_to_the_border(box: Box, side: str, solid: np.ndarray) -> bool:
    """Whether everything ahead of a box is solid."""
    i0, j0, i1, j1 = box
    return bool(
        {
            "west": solid[:i0, j0:j1],
            "east": solid[i1:, j0:j1],
            "south": solid[i0:i1, :j0],
            "north": solid[i0:i1, j1:],
        }[side].all()
    )


def _wall_ends_m(box: Box, side: str, high_end: int, owners: np.ndarray, doors: np.ndarray, size_m: float) -> float:
    """How much of the wall before a box is missing at its low or high end: it stops there, or a door's frame stands."""
    i0, j0, i1, j1 = _ahead(box, side)
    if side in ("west", "east"):
        i, j = i0, (j1 if high_end else j0 - 1)
    else:
        i, j = (i1 if high_end else i0 - 1), j0
    inside = 0 <= i < owners.shape[0] and 0 <= j < owners.shape[1]
    if not inside or owners[i, j] == OUTSIDE:
        return 0.0
    return GAP * size_m + (DOOR_FRAME_M if doors[i, j] else 0.0)


def _runs(row: np.ndarray) -> list[tuple[int, int, int]]:
    """Start, end and owner of the runs of one owner in a row, but for what is outside."""
    marks = np.flatnonzero(np.diff(row)) + 1
    starts, ends = [0, *marks.tolist()], [*marks.tolist(), len(row)]
    return [(a, b, int(row[a])) for a, b in zip(starts, ends, strict=True) if row[a] != OUTSIDE]
