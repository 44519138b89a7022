"""Furniture for the places that a layout gives: whatever fits there and is high enough to be seen from beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from clearway.rooms.camera import CAMERA_HEIGHT_M, VERTICAL_FOV_DEG
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import bathroom, beds, decor, kitchen, lamps, seating, storage, tables_and_desks
from clearway.rooms.plans.layout import Piece
from clearway.rooms.room import Room

HEADBOARD_M = 1.05  # what hangs over a bed hangs higher
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
        once: at most one in a room or area.
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


def _white_cupboard(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    storage.wardrobe(room, at, width_m, 2.0, depth_m, "white")


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


def _vanity(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    bathroom.vanity(room, at, width_m, depth_m)


def _bathtub(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    bathroom.bathtub(room, at, width_m, depth_m)


def _toilet(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A toilet, and what fits beside it: a bin, or a shelf with towels."""
    bathroom.toilet(room, at.moved(-max(width_m - 1.0, 0.0) / 2, 0), min(depth_m, 0.75))
    if width_m > 1.0:
        _towels(room, at.moved(width_m / 2 - 0.2, 0), 0.36, min(depth_m, 0.45))


def _shower(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    bathroom.shower(room, at, width_m, depth_m)


def _washing_machine(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A washing machine with its back at the wall, and a cupboard where there is room beside it."""
    spare_m = width_m - 0.6
    bathroom.washing_machine(room, at.moved(spare_m / 2, 0.28 - depth_m / 2))
    if spare_m > 0.2:
        room.box(at.moved(-0.31, 0), (0, -0.01, 0), (spare_m - 0.02, depth_m - 0.02, 0.85), "white", 0.01)
        room.ball(at.moved(-0.31, depth_m / 2), (0.3 * spare_m, -0.01, 0.6), (0.014, 0.014, 0.014), "chrome", slices=8)


def _towels(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """An open rack with folded towels."""
    for x in (-1, 1):
        for y in (-1, 1):
            room.box(
                at, (x * (width_m / 2 - 0.015), y * (depth_m / 2 - 0.015), 0), (0.025, 0.025, 1.2), "chrome", 0.003
            )
    for number, z_m in enumerate((0.12, 0.5, 0.88, 1.18)):
        room.box(at, (0, 0, z_m), (width_m, depth_m, 0.02), "white", 0.004)
        if number < 3:
            material = ("accent", "linen", "second accent")[(number + int(room.rng.integers(3))) % 3]
            for layer in range(2):
                size = (0.8 * width_m, 0.8 * depth_m, 0.07)
                room.box(at, (0, 0, z_m + 0.02 + 0.072 * layer), size, material, 0.025, segments=2)


def _fridge(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A fridge, and a narrow worktop where there is room beside it."""
    own_m = min(width_m, 0.7)
    kitchen.fridge(room, at.moved((width_m - own_m) / 2, 0), own_m, depth_m)
    if width_m - own_m > 0.2:
        kitchen.counter(room, at.moved(-own_m / 2, 0), width_m - own_m - 0.01, "granite", depth_m)


def _cooker(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A worktop with four rings and a pot, over an oven."""
    kitchen.counter(room, at, width_m, "granite", depth_m)
    room.box(at, (0, 0, kitchen.WORKTOP_M - 0.002), (0.56, min(0.48, depth_m - 0.04), 0.012), "black", 0.004)
    for x_m in (-0.14, 0.14):
        for y_m in (-0.1, 0.1):
            room.cylinder(at, (x_m, y_m, kitchen.WORKTOP_M + 0.009), 0.075, 0.004, "steel")
    kitchen.pot(room, at.moved(-0.14, -0.1), kitchen.WORKTOP_M + 0.013)
    front_m = depth_m / 2
    room.box(at, (0, front_m - 0.016, 0.14), (0.56, 0.03, 0.66), "steel", 0.008)
    room.box(at, (0, front_m - 0.002, 0.24), (0.42, 0.012, 0.32), "black", 0.005)
    room.rod(at, (-0.22, front_m + 0.025, 0.66), (0.22, front_m + 0.025, 0.66), 0.01, "chrome")


def _daybed(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A bed along the wall."""
    along = at.moved(0, 0, 0, 90.0 if room.layout_rng.random() < 0.5 else -90.0)
    beds.double_bed(room, along.moved(0, 0.02), depth_m - 2 * OVERHANG_M, width_m - 2 * OVERHANG_M)


def _coats(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A bench for shoes before a panel with coats on hooks."""
    back_m = 0.015 - depth_m / 2
    room.box(at, (0, back_m, 0.1), (width_m - 0.04, 0.03, 1.7), "pine", 0.006)
    for z_m in (0.14, 0.42):
        room.box(at, (0, 0, z_m), (width_m - 0.04, depth_m, 0.03), "pine", 0.006)
    for side in (-1, 1):
        room.box(at, (side * (width_m / 2 - 0.035), 0, 0), (0.03, depth_m - 0.01, 0.45), "pine", 0.005)
    count = max(2, int(width_m / 0.24))
    for number in range(count):
        x_m = (number - (count - 1) / 2) * (width_m - 0.2) / count
        room.rod(at, (x_m, back_m + 0.01, 1.62), (x_m, back_m + 0.08, 1.65), 0.008, "brass")
        if room.rng.random() < 0.7:
            material = ("accent", "linen", "second accent", "curtain")[int(room.rng.integers(4))]
            room.cloth(at, (x_m, back_m + 0.07, 0.85), (0.2, 0.78), 3, material)
    for x_m in (-0.25, 0.2):
        if width_m > 0.8:
            room.box(at, (x_m * width_m, 0.02, 0.17), (0.1, 0.26, 0.09), "black", 0.03, segments=2)


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


NARROW: tuple[Kind, ...] = (ANYWHERE[0], ANYWHERE[2])  # stands and low shelves
BY_USE: dict[str, tuple[Kind, ...]] = {
    "kitchen": (
        *KITCHEN,
        Kind(_fridge, (0.55, 1.4), (0.4, 0.85), 1.85, at_wall=True, once=True),
        Kind(_cooker, (0.6, 1.6), (0.4, 0.85), 0.95, at_wall=True, once=True),
        *NARROW,
    ),
    "living room": (*LIVING, *NARROW),
    "bedroom": (
        *(replace(kind, top_m=HEADBOARD_M) if kind.place is _bed else kind for kind in BEDROOM),
        Kind(_daybed, (1.75, 2.4), (0.8, 1.3), HEADBOARD_M, at_wall=True, once=True),
        *NARROW,
    ),
    "bathroom": (
        Kind(_vanity, (0.55, 1.7), (0.4, 0.75), 1.0, at_wall=True, once=True),
        Kind(_bathtub, (1.3, 2.2), (0.65, 1.1), 0.71, once=True),
        Kind(_shower, (0.75, 1.3), (0.75, 1.3), 2.0, at_wall=True, once=True),
        Kind(_toilet, (0.45, 1.7), (0.45, 0.9), 0.8, at_wall=True, once=True),
        Kind(_washing_machine, (0.6, 1.3), (0.56, 0.8), 1.07, at_wall=True, once=True),
        Kind(_towels, (0.2, 0.9), (0.2, 0.6), 1.2),
        Kind(_white_cupboard, (0.4, 2.2), (0.3, 0.85), 2.0, at_wall=True),
    ),
    "corridor": (
        Kind(_coats, (0.6, 2.2), (0.25, 0.6), 1.8, at_wall=True),
        Kind(_chest, (0.35, 1.8), (0.2, 0.8), 1.05),
        Kind(_sideboard, (0.8, 2.2), (0.35, 0.7), 0.9),
        Kind(_bookcase, (0.35, 1.4), (0.15, 0.6), 1.9),
        *NARROW,
    ),
}
FIRST: dict[str, tuple[Kind, ...]] = {
    use: tuple(kind for kind in kinds if kind.once and kind.place is not storage.fireplace)
    for use, kinds in BY_USE.items()
}  # what a room of a use must have, as far as it has places for it


def furnish(room: Room, pieces: Sequence[Piece], nearest_m: float) -> list[float]:
    """Put a piece of furniture on every place; the room's layout generator chooses. Returns their heights.

    In an area of a use they are of that use, and what makes a room of it (a bed, a bath) comes first. Elsewhere a theme
    is drawn for each room.

    Args:
        room: to be furnished.
        pieces: the places.
        nearest_m: how near the agent's camera comes to furniture.
    """
    themes = {0: THEMES[int(room.layout_rng.integers(len(THEMES)))] + ANYWHERE}
    used: set[tuple[Kind, object]] = set()
    tops_m = []
    for piece in pieces:
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
        kind.place(room, piece.at, piece.width_m, piece.depth_m)
        room.block(piece.at, (0, 0, BLOCK_HEIGHT_M / 2), (piece.width_m, piece.depth_m, BLOCK_HEIGHT_M))
        tops_m.append(kind.top_m)
    return tops_m


def _lowest_seen_m(distance_m: float) -> float:
    """Height that a level camera sees at the lower edge of its picture, at a distance."""
    return CAMERA_HEIGHT_M - distance_m * math.tan(math.radians(VERTICAL_FOV_DEG / 2))
