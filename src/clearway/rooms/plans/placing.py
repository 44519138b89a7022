"""How kinds of furniture fill the places that a layout gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from clearway.rooms.frame import Frame
from clearway.rooms.furniture import bathroom, beds, decor, kitchen, lamps, seating, storage, tables_and_desks
from clearway.rooms.plans.layout import Piece
from clearway.rooms.room import Room

OVERHANG_M = 0.05  # how far a bed's covers reach beyond it


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


def bookcase(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A bookcase as high as a man."""
    storage.bookcase(room, at, width_m, 1.9, depth_m)


def low_shelf(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A low bookcase with an ornament."""
    storage.bookcase(room, at, width_m, 1.2, depth_m, "oak", 3)
    decor.ornament(room, at, 1.2)


def wardrobe(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A wardrobe."""
    storage.wardrobe(room, at, width_m, 2.1, depth_m)


def pantry(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A tall cupboard in the colour of kitchen fronts."""
    storage.wardrobe(room, at, width_m, 2.0, depth_m, "cabinet")


def white_cupboard(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A tall white cupboard."""
    storage.wardrobe(room, at, width_m, 2.0, depth_m, "white")


def chest(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A chest of drawers with a plant."""
    storage.drawers(room, at, width_m, 1.05, depth_m, 4, max(1, round(width_m / 0.6)), "pine")
    decor.pot_plant(room, at, 1.05)


def white_chest(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A white chest of drawers with a lamp."""
    storage.drawers(room, at, width_m, 0.95, depth_m, 3, max(1, round(width_m / 0.6)), "oak", "white")
    lamps.table_lamp(room, at, 0.95, 0.8)


def sideboard(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A sideboard."""
    storage.sideboard(room, at, width_m, 0.9, depth_m)


def counter(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A worktop over cabinets with an appliance, and a sink where there is room."""
    kitchen.counter(room, at, width_m, "granite", depth_m)
    if width_m > 0.6:
        appliance = (kitchen.toaster, kitchen.kettle, kitchen.jars, kitchen.microwave)[int(room.rng.integers(4))]
        appliance(room, at.moved(-width_m / 4, 0))
    if width_m > 1.3 and depth_m > 0.44:
        kitchen.sink(room, at.moved(width_m / 4, 0))


def television(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A television on its unit."""
    storage.television(room, at, width_m, depth_m)


def table(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A table, laid where it is large enough."""
    tables_and_desks.dining_table(room, at, width_m, depth_m)
    if width_m > 1.0 and depth_m > 0.7:
        for side in (-1, 1):
            for x_m in (-width_m / 3, width_m / 3):
                tables_and_desks.place_setting(room, at.moved(x_m, side * (depth_m / 2 - 0.17), 0, 90.0 + side * 90.0))


def sofa(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A sofa, or an armchair where it is short."""
    seating.sofa(room, at, width_m, depth_m, str(room.rng.choice(("upholstery", "second accent"))))


def bed(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A bed with its head at the back."""
    beds.double_bed(room, at.moved(0, 0.02), width_m - 2 * OVERHANG_M, depth_m - 2 * OVERHANG_M)


def stand(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A slim stand of open boards with a plant on it."""
    for z_m in (0.02, 0.34, 0.66, 0.98):
        room.box(at, (0, 0, z_m), (width_m, depth_m, 0.03), "walnut", 0.004)
    for x in (-1, 1):
        for y in (-1, 1):
            room.box(at, (x * (width_m / 2 - 0.012), y * (depth_m / 2 - 0.012), 0), (0.02, 0.02, 1.0), "walnut", 0.003)
    decor.ornament(room, at, 0.37)
    decor.pot_plant(room, at, 1.01)


def pillar(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A pillar up to the ceiling."""
    side_m = min(width_m, depth_m)
    room.box(at, (0, 0, 0), (width_m, depth_m, 0.12), "trim", 0.006)
    room.box(at, (0, 0, 0.12), (width_m - 0.02, depth_m - 0.02, room.height_m - 0.12), "white", 0.1 * side_m)


def half_wall(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A low brick wall with a wooden top and plants."""
    room.box(at, (0, 0, 0), (width_m, depth_m, 1.06), "brick", 0.006, grain_up=True)
    room.box(at, (0, 0, 1.06), (width_m + 0.01, depth_m + 0.01, 0.04), "walnut", 0.008)
    for share in (-0.3, 0.3):
        decor.pot_plant(room, at.moved(share * width_m, 0), 1.1)


def cupboard(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
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


def vanity(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A washstand."""
    bathroom.vanity(room, at, width_m, depth_m)


def bathtub(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A bath."""
    bathroom.bathtub(room, at, width_m, depth_m)


def toilet(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A toilet, and what fits beside it: a bin, or a shelf with towels."""
    bathroom.toilet(room, at.moved(-max(width_m - 1.0, 0.0) / 2, 0), min(depth_m, 0.75))
    if width_m > 1.0:
        towels(room, at.moved(width_m / 2 - 0.2, 0), 0.36, min(depth_m, 0.45))


def shower(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A shower."""
    bathroom.shower(room, at, width_m, depth_m)


def washing_machine(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A washing machine with its back at the wall, and a cupboard where there is room beside it."""
    spare_m = width_m - 0.6
    bathroom.washing_machine(room, at.moved(spare_m / 2, 0.28 - depth_m / 2))
    if spare_m > 0.2:
        room.box(at.moved(-0.31, 0), (0, -0.01, 0), (spare_m - 0.02, depth_m - 0.02, 0.85), "white", 0.01)
        room.ball(at.moved(-0.31, depth_m / 2), (0.3 * spare_m, -0.01, 0.6), (0.014, 0.014, 0.014), "chrome", slices=8)


def towels(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
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


def fridge(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A fridge, and a narrow worktop where there is room beside it."""
    own_m = min(width_m, 0.7)
    kitchen.fridge(room, at.moved((width_m - own_m) / 2, 0), own_m, depth_m)
    if width_m - own_m > 0.2:
        kitchen.counter(room, at.moved(-own_m / 2, 0), width_m - own_m - 0.01, "granite", depth_m)


def cooker(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
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


def daybed(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A bed along the wall."""
    along = at.moved(0, 0, 0, 90.0 if room.layout_rng.random() < 0.5 else -90.0)
    beds.double_bed(room, along.moved(0, 0.02), depth_m - 2 * OVERHANG_M, width_m - 2 * OVERHANG_M)


def coats(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
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
