"""Plans by request: the stages in turn, what is rejected and drawn again, and the plan with walls, doors and areas."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from clearway.errors import ClearwayError
from clearway.generation.furnish import furnished, is_connected
from clearway.generation.outline import draw_outline, inside_of
from clearway.generation.request import Request
from clearway.generation.split import owner
from clearway.generation.statistics import PlanStatistics, plan_statistics
from clearway.generation.structure import Structure, draw_structure
from clearway.scenes.floor_plans import Area, FloorPlan

CELL_SIZE_M = 0.5
MOST_ATTEMPTS = 2_000
ROOM_LIMITS: dict[str, tuple[float, float]] = {
    "cells": (11, 60),
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
    """

    inside: np.ndarray
    free: np.ndarray
    doors: np.ndarray
    areas: tuple[Area, ...]


def generated_plan(request: Request) -> FloorPlan:
    """The plan of a request; the same cells, walls, doors and areas whoever asks, wherever."""
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
    """A furnished room of some use; None where furniture leaves too little."""
    inside = inside_of(draw_outline(use, rng), rng)
    free = furnished(inside, use, np.zeros_like(inside), rng)
    if free.sum() < LEAST_FREE:
        return None
    width, depth = inside.shape
    return Draft(inside, free, np.zeros((0, 2), np.int64), (Area(use, (0, 0), (width - 1, depth - 1)),))


def draw_flat(rng: np.random.Generator) -> Draft | None:
    """A furnished flat; None where rooms meet, one is too full, or a part cannot be reached."""
    structure = _from_origin(draw_structure(rng))
    areas, doors = structure.areas, np.array(structure.doors, np.int64)
    inside = np.zeros(np.max([area.high for area in areas], axis=0) + 1, bool)
    for area in areas:
        (x0, z0), (x1, z1) = area.low, area.high
        around = inside[max(0, x0 - 1) : x1 + 2, max(0, z0 - 1) : z1 + 2]
        if around.any():  # a wall of one cell at least, all around
            return None
        inside[x0 : x1 + 1, z0 : z1 + 1] = True
    opening = np.zeros_like(inside)
    opening[tuple(doors.T)] = True
    beside_door = _beside(opening)
    free = opening.copy()
    for area in areas:
        (x0, z0), (x1, z1) = area.low, area.high
        part = np.s_[x0 : x1 + 1, z0 : z1 + 1]
        free[part] = furnished(inside[part], area.use, beside_door[part], rng)
        if free[part].sum() < LEAST_FREE:
            return None
    return Draft(inside | opening, free, doors, areas) if is_connected(free) else None


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
    return Draft(map_turned(draft.inside), map_turned(draft.free), cells_turned(draft.doors), tuple(areas))


def finished(draft: Draft, name: str) -> FloorPlan:
    """The plan of a draft: cells, and a wall wherever nothing is inside, one cell around everything."""
    inside, free = np.pad(draft.inside, 1), np.pad(draft.free, 1)
    return FloorPlan(
        name=name,
        cells=np.argwhere(free),
        cell_size_m=CELL_SIZE_M,
        walls=np.argwhere(~inside),
        doors=draft.doors + 1,
        areas=tuple(
            Area(area.use, (area.low[0] + 1, area.low[1] + 1), (area.high[0] + 1, area.high[1] + 1))
            for area in draft.areas
        ),
    )


def _from_origin(structure: Structure) -> Structure:
    """The structure, moved so that its lowest cell is (0, 0)."""
    x, z = np.min([area.low for area in structure.areas], axis=0).tolist()
    areas = tuple(
        Area(area.use, (area.low[0] - x, area.low[1] - z), (area.high[0] - x, area.high[1] - z))
        for area in structure.areas
    )
    return Structure(areas, tuple((door[0] - x, door[1] - z) for door in structure.doors))


def _beside(marked: np.ndarray) -> np.ndarray:
    """(X, Z) bool, the four neighbours of marked cells."""
    around = np.pad(marked, 1)
    return around[:-2, 1:-1] | around[2:, 1:-1] | around[1:-1, :-2] | around[1:-1, 2:]
