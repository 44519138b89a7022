"""Plans by request: the stages in turn, what is rejected and drawn again, and the plan with all its parts."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from clearway.errors import ClearwayError
from clearway.generation.furnish import Furnished, Zone, furnished, is_connected
from clearway.generation.outline import draw_outline, inside_of
from clearway.generation.request import Request
from clearway.generation.split import owner
from clearway.generation.statistics import PlanStatistics, plan_statistics
from clearway.generation.structure import CORRIDOR, Structure, draw_structure
from clearway.rooms.plans.rectangles import rectangles
from clearway.scenes.floor_plans import FRONTS, Area, FloorPlan, Furnishing

CELL_SIZE_M = 0.5
MOST_ATTEMPTS = 2_000
ROOM_LIMITS: dict[str, tuple[float, float]] = {
    "cells": (13, 60),  # real ones from 11; rooms so small would often be alike
    "blocked_share": (0.12, 0.52),
    "dead_ends": (0, 4),
    "mean_path_steps": (3.7, 10.0),
    "longest_path_steps": (9, 29),
    "blank_share": (0.23, 0.39),
}
"""Where 5 to 95 % of 48 real AI2-THOR rooms lie on a grid of 0.5 m (docs/scenes.md); other rooms are drawn again."""
LEAST_FREE = 6  # cells of every room of a flat


@dataclass(frozen=True)
class Drawn:
    """A plan, and what it took.

    Attributes:
        plan: the plan, named after its request.
        rejected: attempts that were drawn again, by why.
    """

    plan: FloorPlan
    rejected: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class Draft:
    """A plan before it has a name.

    Attributes:
        inside: (X, Z) bool, what walls enclose, doors included.
        free: (X, Z) bool, what of it can be entered.
        doors: (D, 2) int, cells.
        areas: what is used as what.
        furniture: what stands on the cells inside that cannot be entered.
    """

    inside: np.ndarray
    free: np.ndarray
    doors: np.ndarray
    areas: tuple[Area, ...]
    furniture: tuple[Furnishing, ...]


def generated_plan(request: Request) -> FloorPlan:
    """The plan of a request; the same cells, walls, doors, areas and furniture whoever asks, wherever."""
    return draw_plan(request).plan


def draw_plan(request: Request) -> Drawn:
    """The plan of a request, and what was rejected before it: `blocked`, `unlike` real rooms, `split` of another.

    Raises:
        ClearwayError: no attempt gave a plan, which no request is known to do.
    """
    rejected: Counter[str] = Counter()
    for attempt in range(MOST_ATTEMPTS):
        rng = request.random(attempt)
        draft = draw_flat(rng) if request.use is None else draw_room(request.use, rng)
        if draft is None:
            rejected["blocked"] += 1
            continue
        plan = finished(turned(draft, int(rng.integers(8))), request.name)
        if owner(plan.cells) != request.split:
            rejected["split"] += 1
        elif request.kind == "room" and not is_like_real_rooms(plan_statistics(plan)):
            rejected["unlike"] += 1
        else:
            return Drawn(plan, rejected)
    told = ", ".join(f"{count} {why}" for why, count in rejected.items())
    raise ClearwayError(f"{request.name}: no plan in {MOST_ATTEMPTS} attempts ({told}). Ask for another seed")


def draw_room(use: str, rng: np.random.Generator) -> Draft | None:
    """A furnished room of some use; None where furniture leaves too little, or what it must have finds no place."""
    inside = inside_of(draw_outline(use, rng), rng)
    done = furnished([Zone(use, inside)], np.zeros_like(inside), rng)
    if done is None or done.free.sum() < LEAST_FREE:
        return None
    width, depth = inside.shape
    areas = (Area(use, (0, 0), (width - 1, depth - 1)),)
    return Draft(inside, done.free, np.zeros((0, 2), np.int64), areas, tuple(_named(done, (0, 0))))


def draw_flat(rng: np.random.Generator) -> Draft | None:
    """A furnished flat; None where no rooms fit, one is too full or bare, or a part cannot be reached."""
    structure = draw_structure(rng)
    if structure is None:
        return None
    numbers, doors = structure.numbers, np.array(structure.doors, np.int64)
    opening = np.zeros(numbers.shape, bool)
    opening[tuple(doors.T)] = True
    kept, free = _beside(opening) | _entrance(structure), opening.copy()
    areas: list[Area] = []
    furniture: list[Furnishing] = []
    for room in _open_rooms(numbers):
        places = np.argwhere(np.isin(numbers, room))
        (x0, z0), (x1, z1) = places.min(axis=0).tolist(), (places.max(axis=0) + 1).tolist()
        part = np.s_[x0:x1, z0:z1]
        zones = [Zone(structure.uses[number - 1], numbers[part] == number) for number in room]
        done = furnished(zones, kept[part], rng)
        if done is None or any((done.free & zone.inside).sum() < LEAST_FREE for zone in zones):
            return None
        free[part] |= done.free
        furniture += _named(done, (x0, z0))
        areas += [
            Area(zone.use, (x0 + i0, z0 + j0), (x0 + i1 - 1, z0 + j1 - 1))
            for zone in zones
            for i0, j0, i1, j1 in rectangles(zone.inside, max(zone.inside.shape))
        ]
    if not is_connected(free):
        return None
    return Draft((numbers > 0) | opening, free, doors, tuple(areas), tuple(furniture))


def _named(done: Furnished, origin: tuple[int, int]) -> list[Furnishing]:
    """The pieces of a room whose map begins at some cell."""
    x, z = origin
    return [
        Furnishing(piece.kind, (x + at.x0, z + at.z0), (x + at.x1 - 1, z + at.z1 - 1), at.front)
        for piece, at in done.pieces
    ]


def _open_rooms(numbers: np.ndarray) -> list[list[int]]:
    """The numbers of rooms from 1, those together that no wall is between."""
    beside = [(numbers[:-1], numbers[1:]), (numbers[:, :-1], numbers[:, 1:])]
    together = {
        (int(a), int(b)) for one, other in beside for a, b in zip(one[one != other], other[one != other], strict=True)
    }
    rooms: list[list[int]] = []
    for number in range(1, int(numbers.max()) + 1):
        joined = next((room for room in rooms if {(number, room[0]), (room[0], number)} & together), None)
        if joined is None:
            rooms.append([number])
        else:
            joined.append(number)
    return rooms


def _entrance(structure: Structure) -> np.ndarray:
    """(X, Z) bool, the corridor's cells at the border of the flat, where its front door may be."""
    corridor = structure.numbers == structure.uses.index(CORRIDOR) + 1
    inner = np.zeros_like(corridor)
    inner[1:-1, 1:-1] = True
    return corridor & ~inner


def is_like_real_rooms(figures: PlanStatistics) -> bool:
    """Whether a room lies within `ROOM_LIMITS`, in one part."""
    found = figures.to_json()
    return figures.parts == 1 and all(low <= found[name] <= high for name, (low, high) in ROOM_LIMITS.items())


def turned(draft: Draft, way: int) -> Draft:
    """One of the eight ways, 0 to 7, to turn and mirror a draft."""
    flips = tuple(axis for axis in (0, 1) if way >> axis & 1)
    swapped = bool(way >> 2 & 1)
    last = np.array(draft.inside.shape) - 1

    def map_turned(values: np.ndarray) -> np.ndarray:
        flipped = np.flip(values, flips)
        return flipped.T.copy() if swapped else flipped.copy()

    def cells_turned(cells: np.ndarray) -> np.ndarray:
        moved = cells.copy()
        for axis in flips:
            moved[:, axis] = last[axis] - moved[:, axis]
        return moved[:, ::-1] if swapped else moved

    areas = []
    for area in draft.areas:
        corners = cells_turned(np.array([area.low, area.high], np.int64))
        low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        areas.append(Area(area.use, (low[0], low[1]), (high[0], high[1])))
    fronts = dict(zip(FRONTS, _fronts_turned(flips, swapped), strict=True))
    furniture = []
    for piece in draft.furniture:
        corners = cells_turned(np.array([piece.low, piece.high], np.int64))
        low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        furniture.append(Furnishing(piece.kind, (low[0], low[1]), (high[0], high[1]), fronts[piece.front]))
    inside, free, doors = map_turned(draft.inside), map_turned(draft.free), cells_turned(draft.doors)
    return Draft(inside, free, doors, tuple(areas), tuple(furniture))


def _fronts_turned(flips: tuple[int, ...], swapped: bool) -> list[str]:
    """What becomes of each of `FRONTS` where axes are flipped, then perhaps swapped."""
    turned_to = []
    for front in FRONTS:
        axis, ahead = (1 if front in ("south", "north") else 0), front in ("north", "east")
        ahead ^= axis in flips
        axis ^= swapped
        turned_to.append((("west", "east"), ("south", "north"))[axis][ahead])
    return turned_to


def finished(draft: Draft, name: str) -> FloorPlan:
    """The plan of a draft: cells, and a wall wherever nothing is inside, one cell around everything."""
    inside, free = np.pad(draft.inside, 1), np.pad(draft.free, 1)
    return FloorPlan(
        name=name,
        cells=np.argwhere(free),
        cell_size_m=CELL_SIZE_M,
        walls=np.argwhere(~inside),
        doors=draft.doors + 1,
        areas=tuple(Area(area.use, _moved(area.low), _moved(area.high)) for area in draft.areas),
        furniture=tuple(
            Furnishing(piece.kind, _moved(piece.low), _moved(piece.high), piece.front) for piece in draft.furniture
        ),
    )


def _moved(cell: tuple[int, int]) -> tuple[int, int]:
    """A cell of a draft, in its plan with the wall around it."""
    return cell[0] + 1, cell[1] + 1


def _beside(marked: np.ndarray) -> np.ndarray:
    """(X, Z) bool, the four neighbours of marked cells."""
    around = np.pad(marked, 1)
    return around[:-2, 1:-1] | around[2:, 1:-1] | around[1:-1, :-2] | around[1:-1, 2:]
