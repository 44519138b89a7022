"""Furniture for the places that a layout gives: whatever fits there and is high enough to be seen from beside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from clearway.rooms.camera import CAMERA_HEIGHT_M, VERTICAL_FOV_DEG
from clearway.rooms.furniture import storage, tables_and_desks
from clearway.rooms.plans import placing
from clearway.rooms.plans.layout import Piece
from clearway.rooms.plans.named import NAMED
from clearway.rooms.plans.placing import Kind
from clearway.rooms.room import Room

HEADBOARD_M = 1.05  # what hangs over a bed hangs higher
BLOCK_HEIGHT_M = 0.4  # of the obstacle that fills a place whatever stands there

KITCHEN: tuple[Kind, ...] = (
    Kind(placing.counter, (0.4, 2.4), (0.35, 0.85), 0.9, at_wall=True),
    Kind(placing.pantry, (0.5, 2.2), (0.35, 0.85), 2.0, at_wall=True),
    Kind(placing.sideboard, (0.8, 2.2), (0.35, 0.7), 0.9),
    Kind(placing.table, (0.7, 2.4), (0.6, 2.0), 0.75, at_wall=False),
)
LIVING: tuple[Kind, ...] = (
    Kind(placing.bookcase, (0.35, 1.4), (0.15, 0.6), 1.9),
    Kind(placing.sideboard, (0.8, 2.2), (0.35, 0.7), 0.9),
    Kind(placing.television, (1.25, 2.2), (0.35, 0.7), 1.2, at_wall=True, once=True),
    Kind(storage.fireplace, (1.0, 1.7), (0.35, 0.7), 1.16, at_wall=True, once=True),
    Kind(placing.sofa, (0.7, 2.4), (0.7, 1.4), 0.76),
    Kind(placing.table, (0.7, 2.4), (0.6, 2.0), 0.75, at_wall=False),
)
BEDROOM: tuple[Kind, ...] = (
    Kind(placing.wardrobe, (0.5, 2.2), (0.35, 1.0), 2.1, at_wall=True),
    Kind(placing.chest, (0.35, 1.8), (0.2, 0.8), 1.05),
    Kind(placing.white_chest, (0.35, 1.8), (0.25, 0.8), 0.95),
    Kind(tables_and_desks.desk, (1.0, 2.0), (0.5, 0.9), 0.74, at_wall=True),
    Kind(placing.bed, (1.2, 2.3), (1.4, 2.3), 0.6, once=True),
    Kind(placing.sofa, (0.7, 2.4), (0.7, 1.4), 0.76),
)
THEMES = (KITCHEN, LIVING, BEDROOM)
ANYWHERE: tuple[Kind, ...] = (
    Kind(placing.stand, (0.08, 0.45), (0.08, 0.45), 1.01),
    Kind(placing.pillar, (0.08, 0.45), (0.08, 0.45), 2.6, at_wall=False),
    Kind(placing.low_shelf, (0.35, 1.5), (0.12, 0.45), 1.2),
    Kind(placing.half_wall, (0.5, 8.0), (0.08, 0.35), 1.1, at_wall=False),
    Kind(placing.bookcase, (0.35, 1.5), (0.15, 0.6), 1.9),
)
LAST_RESORT = Kind(placing.cupboard, (0.0, math.inf), (0.0, math.inf), 1.25)


NARROW: tuple[Kind, ...] = (ANYWHERE[0], ANYWHERE[2])  # stands and low shelves
BY_USE: dict[str, tuple[Kind, ...]] = {
    "kitchen": (
        *KITCHEN,
        Kind(placing.fridge, (0.55, 1.4), (0.4, 0.85), 1.85, at_wall=True, once=True),
        Kind(placing.cooker, (0.6, 1.6), (0.4, 0.85), 0.95, at_wall=True, once=True),
        *NARROW,
    ),
    "living room": (*LIVING, *NARROW),
    "bedroom": (
        *(replace(kind, top_m=HEADBOARD_M) if kind.place is placing.bed else kind for kind in BEDROOM),
        Kind(placing.daybed, (1.75, 2.4), (0.8, 1.3), HEADBOARD_M, at_wall=True, once=True),
        *NARROW,
    ),
    "bathroom": (
        Kind(placing.vanity, (0.55, 1.7), (0.4, 0.75), 1.0, at_wall=True, once=True),
        Kind(placing.bathtub, (1.3, 2.2), (0.65, 1.1), 0.71, once=True),
        Kind(placing.shower, (0.75, 1.3), (0.75, 1.3), 2.0, at_wall=True, once=True),
        Kind(placing.toilet, (0.45, 1.7), (0.45, 0.9), 0.8, at_wall=True, once=True),
        Kind(placing.washing_machine, (0.6, 1.3), (0.56, 0.8), 1.07, at_wall=True, once=True),
        Kind(placing.towels, (0.2, 0.9), (0.2, 0.6), 1.2),
        Kind(placing.white_cupboard, (0.4, 2.2), (0.3, 0.85), 2.0, at_wall=True),
    ),
    "corridor": (
        Kind(placing.coats, (0.6, 2.2), (0.25, 0.6), 1.8, at_wall=True),
        Kind(placing.chest, (0.35, 1.8), (0.2, 0.8), 1.05),
        Kind(placing.sideboard, (0.8, 2.2), (0.35, 0.7), 0.9),
        Kind(placing.bookcase, (0.35, 1.4), (0.15, 0.6), 1.9),
        *NARROW,
    ),
}
FIRST: dict[str, tuple[Kind, ...]] = {
    use: tuple(kind for kind in kinds if kind.once and kind.place is not storage.fireplace)
    for use, kinds in BY_USE.items()
}  # what a room of a use must have, as far as it has places for it


def furnish(room: Room, pieces: Sequence[Piece], nearest_m: float) -> list[float]:
    """Put a piece of furniture on every place; the room's layout generator chooses. Returns their heights.

    What the plan names stands where it says. Other pieces in an area of a use are of that use, and what makes a room of
    it (a bed, a bath) comes first. Elsewhere a theme is drawn for each room.

    Args:
        room: to be furnished.
        pieces: the places.
        nearest_m: how near the agent's camera comes to furniture.
    """
    themes = {0: THEMES[int(room.layout_rng.integers(len(THEMES)))] + ANYWHERE}
    used: set[tuple[Kind, object]] = set()
    tops_m = []
    for piece in pieces:
        if piece.kind is not None:
            named = NAMED[piece.kind]
            tops_m.append(_placed(room, piece, named[int(room.layout_rng.integers(len(named)))]))
            continue
        if piece.area is None and piece.room not in themes:
            themes[piece.room] = THEMES[int(room.layout_rng.integers(len(THEMES)))] + ANYWHERE
        kinds = themes[piece.room] if piece.area is None else BY_USE[piece.area.use]
        where = piece.area or piece.room
        lowest_m = _lowest_seen_m(nearest_m + min(piece.width_m, piece.depth_m) / 2)
        fitting = [kind for kind in kinds if (kind, where) not in used and kind.fits(piece, lowest_m)]
        first = [] if piece.area is None else [kind for kind in fitting if kind in FIRST[piece.area.use]]
        fitting = first or fitting or [LAST_RESORT]
        kind = fitting[int(room.layout_rng.integers(len(fitting)))]
        if kind.once:
            used.add((kind, where))
        tops_m.append(_placed(room, piece, kind))
    return tops_m


def _placed(room: Room, piece: Piece, kind: Kind) -> float:
    """Put furniture on a place, all of which it blocks. Returns its height."""
    with room.one_piece():
        kind.place(room, piece.at, piece.width_m, piece.depth_m)
        room.block(piece.at, (0, 0, BLOCK_HEIGHT_M / 2), (piece.width_m, piece.depth_m, BLOCK_HEIGHT_M))
    return kind.top_m


def _lowest_seen_m(distance_m: float) -> float:
    """Height that a level camera sees at the lower edge of its picture, at a distance."""
    return CAMERA_HEIGHT_M - distance_m * math.tan(math.radians(VERTICAL_FOV_DEG / 2))
