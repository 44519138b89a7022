"""Furniture that a plan names: how each kind of it fills its place."""

from __future__ import annotations

from clearway.rooms.frame import Frame
from clearway.rooms.furniture import bathroom, decor, kitchen, lamps, seating, storage, tables_and_desks
from clearway.rooms.plans import placing
from clearway.rooms.plans.placing import Kind
from clearway.rooms.room import Room

CHAIR_M = 0.25  # of a chair that shows beside its table
COOKER_M = 0.6
CABINETS_TOP_M = 2.14  # of what hangs over a worktop
GLASS_M = (1.05, 0.75)  # where a looking-glass over a basin begins, and how high it is


def fitted_kitchen(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A worktop with a sink, and a cooker at one end."""
    _worktop_with_cooker(room, at, width_m, depth_m)


def _worktop_with_cooker(room: Room, at: Frame, width_m: float, depth_m: float) -> int:
    """The same; gives the end at which the cooker is, 1 or -1 along x, which the room's layout generator chooses."""
    side, rest_m = (1 if room.layout_rng.random() < 0.5 else -1), width_m - COOKER_M
    placing.cooker(room, at.moved(side * rest_m / 2, 0), COOKER_M, depth_m)
    worktop = at.moved(-side * COOKER_M / 2, 0)
    kitchen.counter(room, worktop, rest_m - 0.01, "granite", depth_m)
    sink_m = 0.0 if rest_m < 1.2 else side * (rest_m / 2 - 0.45)
    kitchen.sink(room, worktop.moved(sink_m, 0), depth_m)
    if rest_m > 1.2:
        appliance = (kitchen.toaster, kitchen.kettle, kitchen.jars, kitchen.microwave)[int(room.rng.integers(4))]
        appliance(room, worktop.moved(-side * (rest_m / 2 - 0.3), -0.02))
    return side


def fitted_kitchen_with_cabinets(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """The same with cabinets and an extractor hood on the wall above it."""
    side, rest_m = _worktop_with_cooker(room, at, width_m, depth_m), width_m - COOKER_M
    wall = at.moved(0, -depth_m / 2)
    kitchen.wall_cabinets(room, wall.moved(-side * COOKER_M / 2, 0), rest_m)
    kitchen.hood(room, wall.moved(side * rest_m / 2, 0), COOKER_M)


def worktop_with_cabinets(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A worktop, and cabinets on the wall above it."""
    placing.counter(room, at, width_m, depth_m)
    kitchen.wall_cabinets(room, at.moved(0, -depth_m / 2), width_m)


def island(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A kitchen island with fruit on it."""
    kitchen.island(room, at, width_m, depth_m)
    decor.fruit_bowl(room, at.moved(0.2 * width_m, 0), kitchen.WORKTOP_M)


def dining_table(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A table with chairs at its ends where it is long enough, and along its sides where it is deep enough."""
    at_ends, at_sides = width_m > 1.1, depth_m > 1.1
    table_m = (width_m - 2 * CHAIR_M * at_ends, depth_m - 2 * CHAIR_M * at_sides)
    tables_and_desks.dining_table(room, at, *table_m)
    reach_m = 0.21 - CHAIR_M  # from the table's edge to the middle of a chair
    places = [(sign * (table_m[0] / 2 - reach_m), 0.0, sign * 90.0) for sign in (-1, 1) if at_ends]
    count = max(1, int(table_m[0] / 0.55)) if at_sides else 0
    for number in range(count):
        x_m = (number + 0.5 - count / 2) * table_m[0] / count
        places += [(x_m, sign * (table_m[1] / 2 - reach_m), 90.0 + sign * 90.0) for sign in (-1, 1)]
    for x_m, y_m, yaw_deg in places:
        seating.dining_chair(room, at.moved(x_m, y_m, 0, yaw_deg))


def coffee_table(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A low table, less deep than its place."""
    tables_and_desks.coffee_table(room, at, width_m, min(depth_m, 0.75))


def washbasin(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A washstand, or a basin on a foot where it is narrow, under a looking-glass."""
    if width_m > 0.55:
        bathroom.vanity(room, at, width_m, depth_m)
    else:
        bathroom.basin(room, at, width_m, depth_m)
    low_m, high_m = GLASS_M
    decor.looking_glass(room, at.moved(0, -depth_m / 2, low_m + high_m / 2), min(width_m - 0.06, 0.9), high_m)


def toilet(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A toilet, slimmer in a narrow place."""
    bathroom.toilet(room, at, min(depth_m, 0.7), min(width_m, 0.4))


def nightstand(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """Two drawers with a lamp on them."""
    storage.drawers(room, at, width_m, 0.52, depth_m, 2, 1)
    lamps.table_lamp(room, at, 0.52, 0.85)


def plant(room: Room, at: Frame, width_m: float, depth_m: float) -> None:
    """A leafy plant on a low stand as large as its place."""
    room.box(at, (0, 0, 0), (width_m, depth_m, 0.05), "walnut", 0.006)
    decor.pot_plant(room, at, 0.05, float(room.rng.uniform(0.9, 1.4)))
    room.block(at, (0, 0, 0.5), (width_m, depth_m, 1.0))


NAMED: dict[str, tuple[Kind, ...]] = {
    "armchair": (Kind(placing.sofa, (0.75, 1.2), (0.75, 1.2), 0.76),),
    "basin": (Kind(washbasin, (0.3, 1.7), (0.4, 0.6), sum(GLASS_M), at_wall=True),),
    "bath": (Kind(placing.bathtub, (1.25, 2.3), (0.75, 1.1), 0.71),),
    "bookcase": (
        Kind(placing.bookcase, (0.75, 2.3), (0.3, 0.6), 1.9),
        Kind(placing.low_shelf, (0.75, 2.3), (0.3, 0.6), 1.2),
    ),
    "cabinet": (
        Kind(placing.towels, (0.3, 1.2), (0.3, 0.6), 1.2),
        Kind(placing.white_cupboard, (0.3, 1.2), (0.3, 0.6), 2.0),
    ),
    "chest": (
        Kind(placing.chest, (0.75, 1.8), (0.4, 0.6), 1.05),
        Kind(placing.white_chest, (0.75, 1.8), (0.4, 0.6), 0.95),
    ),
    "coats": (Kind(placing.coats, (0.75, 1.8), (0.4, 0.6), 1.8),),
    "coffee table": (Kind(coffee_table, (0.75, 1.4), (0.75, 0.85), 0.55),),
    "counter": (
        Kind(fitted_kitchen, (1.2, 3.8), (0.45, 0.6), 0.9),
        Kind(fitted_kitchen_with_cabinets, (1.2, 3.8), (0.45, 0.6), CABINETS_TOP_M),
    ),
    "desk": (Kind(tables_and_desks.desk, (0.75, 1.8), (0.45, 0.6), 0.74),),
    "dining table": (Kind(dining_table, (0.75, 2.0), (0.75, 1.5), 0.75),),
    "double bed": (Kind(placing.bed, (1.25, 2.3), (1.85, 2.3), 1.05),),
    "fireplace": (Kind(storage.fireplace, (1.25, 1.8), (0.4, 0.6), 1.16),),
    "fridge": (Kind(placing.fridge, (0.75, 1.2), (0.4, 0.6), 1.85),),
    "island": (Kind(island, (1.25, 1.9), (0.75, 0.85), 0.9),),
    "nightstand": (Kind(nightstand, (0.3, 0.7), (0.4, 0.6), 0.95),),
    "pantry": (
        Kind(placing.pantry, (0.75, 1.8), (0.4, 0.6), 2.0),
        Kind(placing.bookcase, (0.75, 1.8), (0.4, 0.6), 1.9),
    ),
    "plant": (Kind(plant, (0.3, 0.7), (0.3, 0.7), 0.8),),
    "shoe cabinet": (Kind(placing.chest, (0.75, 1.8), (0.4, 0.6), 1.05),),
    "shower": (Kind(placing.shower, (0.75, 1.3), (0.75, 1.3), 2.0),),
    "sideboard": (Kind(placing.sideboard, (0.75, 2.3), (0.4, 0.6), 0.9),),
    "single bed": (Kind(placing.bed, (0.75, 1.3), (1.85, 2.3), 1.05),),
    "sofa": (Kind(placing.sofa, (1.25, 2.8), (0.75, 1.2), 0.76),),
    "table": (Kind(placing.table, (0.75, 1.8), (0.75, 1.2), 0.75),),
    "television": (Kind(placing.television, (1.25, 2.3), (0.4, 0.6), 1.2),),
    "toilet": (Kind(toilet, (0.3, 0.6), (0.4, 0.6), 0.8),),
    "wardrobe": (Kind(placing.wardrobe, (1.25, 2.3), (0.4, 0.6), 2.1),),
    "worktop": (
        Kind(placing.counter, (0.75, 2.3), (0.4, 0.6), 0.9),
        Kind(worktop_with_cabinets, (0.75, 2.3), (0.4, 0.6), CABINETS_TOP_M),
    ),
}
"""By the plan's word for it; where there are several, the room's layout generator chooses."""
