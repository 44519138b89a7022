"""Furniture for the places that a layout gives: whatever fits there and is high enough to be seen from beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from clearway.rooms.camera import CAMERA_HEIGHT_M, VERTICAL_FOV_DEG
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import beds, decor, kitchen, lamps, seating, storage, tables_and_desks
from clearway.rooms.plans.layout import Piece
from clearway.rooms.room import Room

OVERHANG_M = 0.05  # how far a bed's covers reach beyond it
BLOCK_HEIGHT_M = 0.4  # of the obstacle that fills a place whatever stands there


@dataclass(frozen=True)
class Kind:
    """A kind of furniture.

    Attributes:
        place: puts it on a frame, with its width and depth in metres.
        widths_m, depths_m: least and most.
        top_m: height.
        at_wall: True only before a wall, False only elsewhere, None anywhere.
        once: at most one in a room.
    """

    place: Callable[[Room, Frame, float, float], None]
    widths_m: tuple[float, float]
    depths_m: tuple[float, float]
    top_m: float
    at_wall: bool | None = None
    once: bool = False

    def fits(self, piece: Piece, lowest_m: float) -> bool:
        """Whether it may stand in a place whose furniture must be `lowest_m` high to be seen."""
        return (
            self.widths_m[0] <= piece.width_m <= self.widths_m[1]
            and self.depths_m[0] <= piece.depth_m <= self.depths_m[1]
            and self.top_m >= lowest_m
            and self.at_wall in (None, piece.back_at_wall)
        )


def _bookcase(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.bookcase(room, at, width_m, 1.9, depth_m)


def _low_shelf(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.bookcase(room, at, width_m, 1.2, depth_m, "oak", 3)
    decor.ornament(room, at, 1.2)


def _wardrobe(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.wardrobe(room, at, width_m, 2.1, depth_m)


def _pantry(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.wardrobe(room, at, width_m, 2.0, depth_m, "cabinet")


def _chest(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.drawers(room, at, width_m, 1.05, depth_m, 4, max(1, round(width_m / 0.6)), "pine")
    decor.pot_plant(room, at, 1.05)


def _white_chest(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.drawers(room, at, width_m, 0.95, depth_m, 3, max(1, round(width_m / 0.6)), "oak", "white")
    lamps.table_lamp(room, at, 0.95, 0.8)


def _sideboard(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.sideboard(room, at, width_m, 0.9, depth_m)


def _counter(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    kitchen.counter(room, at, width_m, "granite", depth_m)
    if width_m > 0.6:
        appliance = (kitchen.toaster, kitchen.kettle, kitchen.jars, kitchen.microwave)[int(room.rng.integers(4))]
        appliance(room, at.moved(-width_m / 4, 0))
    if width_m > 1.3 and depth_m > 0.44:
        kitchen.sink(room, at.moved(width_m / 4, 0))


def _television(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.television(room, at, width_m, depth_m)


def _table(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    tables_and_desks.dining_table(room, at, width_m, depth_m)
    if width_m > 1.0 and depth_m > 0.7:
        for side in (-1, 1):
            for x_m in (-width_m / 3, width_m / 3):
                tables_and_desks.place_setting(room, at.moved(x_m, side * (depth_m / 2 - 0.17), 0, 90.0 + side * 90.0))


def _sofa(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    seating.sofa(room, at, width_m, depth_m, str(room.rng.choice(("upholstery", "second accent"))))


def _bed(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    beds.double_bed(room, at.moved(0, 0.02), width_m - 2 * OVERHANG_M, depth_m - 2 * OVERHANG_M)


def _stand(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A slim stand of open boards with a plant on it."""
    for z_m in (0.02, 0.34, 0.66, 0.98):
        room.box(at, (0, 0, z_m), (width_m, depth_m, 0.03), "walnut", 0.004)
    for x in (-1, 1):
        for y in (-1, 1):
            room.box(at, (x * (width_m / 2 - 0.012), y * (depth_m / 2 - 0.012), 0), (0.02, 0.02, 1.0), "walnut", 0.003)
    decor.ornament(room, at, 0.37)
    decor.pot_plant(room, at, 1.01)


def _pillar(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A pillar up to the ceiling."""
    side_m = min(width_m, depth_m)
    room.box(at, (0, 0, 0), (width_m, depth_m, 0.12), "trim", 0.006)
    room.box(at, (0, 0, 0.12), (width_m - 0.02, depth_m - 0.02, room.height_m - 0.12), "white", 0.1 * side_m)


def _half_wall(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A low brick wall with a wooden top and plants."""
    room.box(at, (0, 0, 0), (width_m, depth_m, 1.06), "brick", 0.006, grain_up=True)
    room.box(at, (0, 0, 1.06), (width_m + 0.01, depth_m + 0.01, 0.04), "walnut", 0.008)
    for share in (-0.3, 0.3):
        decor.pot_plant(room, at.moved(share * width_m, 0), 1.1)


def _cupboard(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A plain painted cupboard of any size, with a seam every half metre or so."""
    height_m = 1.25
    count = max(1, round(width_m / 0.55))
    leaf_m = width_m / count
    room.box(at, (0, 0, 0.06), (width_m - 0.03, depth_m - 0.03, height_m - 0.09), "cabinet", 0.006)
    room.box(at, (0, 0, 0), (width_m - 0.08, depth_m - 0.08, 0.06), "rubber", segments=0)
    room.box(at, (0, 0, height_m - 0.03), (width_m, depth_m, 0.03), "oak", 0.008)
    for side in (-1, 1):
        front = at if side == 1 else at.moved(0, 0, 0, 180.0)
        for number in range(count):
            x_m = -width_m / 2 + leaf_m * (number + 0.5)
            room.box(front, (x_m, depth_m / 2 - 0.012, 0.08), (leaf_m - 0.02, 0.012, height_m - 0.13), "cabinet", 0.004)
            room.ball(front, (x_m + 0.3 * leaf_m, depth_m / 2 - 0.004, 0.95), (0.012, 0.012, 0.012), "brass", slices=8)
    decor.stack_of_books(room, at, height_m)


KITCHEN: tuple[Kind, ...] = (
    Kind(_counter, (0.4, 2.4), (0.35, 0.85), 0.9, at_wall=True),
    Kind(_pantry, (0.5, 2.2), (0.35, 0.85), 2.0, at_wall=True),
    Kind(_sideboard, (0.8, 2.2), (0.35, 0.7), 0.9),
    Kind(_table, (0.7, 2.4), (0.6, 2.0), 0.75, at_wall=False),
)
LIVING: tuple[Kind, ...] = (
    Kind(_bookcase, (0.35, 1.4), (0.15, 0.6), 1.9),
    Kind(_sideboard, (0.8, 2.2), (0.35, 0.7), 0.9),
    Kind(_television, (1.25, 2.2), (0.35, 0.7), 1.2, at_wall=True, once=True),
    Kind(storage.fireplace, (1.0, 1.7), (0.35, 0.7), 1.16, at_wall=True, once=True),
    Kind(_sofa, (0.7, 2.4), (0.7, 1.4), 0.76),
    Kind(_table, (0.7, 2.4), (0.6, 2.0), 0.75, at_wall=False),
)
BEDROOM: tuple[Kind, ...] = (
    Kind(_wardrobe, (0.5, 2.2), (0.35, 1.0), 2.1, at_wall=True),
    Kind(_chest, (0.35, 1.8), (0.2, 0.8), 1.05),
    Kind(_white_chest, (0.35, 1.8), (0.25, 0.8), 0.95),
    Kind(tables_and_desks.desk, (1.0, 2.0), (0.5, 0.9), 0.74, at_wall=True),
    Kind(_bed, (1.2, 2.3), (1.4, 2.3), 0.6, once=True),
    Kind(_sofa, (0.7, 2.4), (0.7, 1.4), 0.76),
)
THEMES = (KITCHEN, LIVING, BEDROOM)
ANYWHERE: tuple[Kind, ...] = (
    Kind(_stand, (0.08, 0.45), (0.08, 0.45), 1.01),
    Kind(_pillar, (0.08, 0.45), (0.08, 0.45), 2.6, at_wall=False),
    Kind(_low_shelf, (0.35, 1.5), (0.12, 0.45), 1.2),
    Kind(_half_wall, (0.5, 8.0), (0.08, 0.35), 1.1, at_wall=False),
    Kind(_bookcase, (0.35, 1.5), (0.15, 0.6), 1.9),
)
LAST_RESORT = Kind(_cupboard, (0.0, math.inf), (0.0, math.inf), 1.25)


def furnish(room: Room, pieces: Sequence[Piece], nearest_m: float) -> list[float]:
    """Put a piece of furniture on every place; the room's layout generator chooses. Returns their heights.

    Args:
        room: to be furnished.
        pieces: the places.
        nearest_m: how near the agent's camera comes to furniture.
    """
    kinds = THEMES[int(room.layout_rng.integers(len(THEMES)))] + ANYWHERE
    used: set[Kind] = set()
    tops_m = []
    for piece in pieces:
        lowest_m = _lowest_seen_m(nearest_m + min(piece.width_m, piece.depth_m) / 2)
        fitting = [kind for kind in kinds if kind not in used and kind.fits(piece, lowest_m)] or [LAST_RESORT]
        kind = fitting[int(room.layout_rng.integers(len(fitting)))]
        if kind.once:
            used.add(kind)
        kind.place(room, piece.at, piece.width_m, piece.depth_m)
        room.block(piece.at, (0, 0, BLOCK_HEIGHT_M / 2), (piece.width_m, piece.depth_m, BLOCK_HEIGHT_M))
        tops_m.append(kind.top_m)
    return tops_m


def _lowest_seen_m(distance_m: float) -> float:
    """Height that a level camera sees at the lower edge of its picture, at a distance."""
    return CAMERA_HEIGHT_M - distance_m * math.tan(math.radians(VERTICAL_FOV_DEG / 2))
