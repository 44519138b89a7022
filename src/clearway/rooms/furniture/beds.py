"""Beds and what stands beside them."""

from __future__ import annotations

from clearway.rooms.frame import Frame, turn
from clearway.rooms.furniture import decor, lamps
from clearway.rooms.room import Room

NARROW_M = 1.1  # width of a bed for one, at most


def double_bed(room: Room, at: Frame, width_m: float = 1.6, length_m: float = 2.05, material: str = "wood") -> None:
    """A made bed; the headboard is at -y, the frame's origin in the middle of the mattress."""
    half = length_m / 2
    for x in (-1, 1):
        for y in (-1, 1):
            room.box(at, (x * (width_m / 2 - 0.08), y * (half - 0.08), 0), (0.07, 0.07, 0.1), material, 0.006)
    room.box(at, (0, 0, 0.08), (width_m, length_m, 0.22), material, 0.012)
    room.box(at, (0, -half - 0.03, 0), (width_m + 0.08, 0.06, 1.02), material, 0.02)
    for side in (-1, 1):
        room.box(at, (side * width_m / 4, -half + 0.003, 0.55), (width_m / 2 - 0.06, 0.03, 0.4), material, 0.012)
    room.box(at, (0, 0.01, 0.28), (width_m - 0.04, length_m - 0.04, 0.24), "linen", 0.06, segments=3)
    room.box(at, (0, 0.3, 0.3), (width_m + 0.05, length_m - 0.58, 0.26), "duvet", 0.07, segments=3)
    room.box(at, (0, -0.34, 0.5), (width_m + 0.04, 0.3, 0.085), "linen", 0.04, segments=3)
    room.box(at, (0, half - 0.4, 0.53), (width_m + 0.07, 0.45, 0.05), "second accent", 0.024, segments=2)
    _pillows(room, at, width_m, half)
    room.block(at, (0, -0.02, 0.4), (width_m + 0.06, length_m + 0.08, 0.8))


def _pillows(room: Room, at: Frame, width_m: float, half_length_m: float) -> None:
    """Two pillows and two cushions against the headboard; one of each on a narrow bed."""
    narrow = width_m < NARROW_M
    for side, cushion in ((0, "accent"),) if narrow else ((-1, "accent"), (1, "second accent")):
        x = side * width_m / 4
        room.box(
            at,
            (x, -half_length_m + 0.3, 0.52),
            (width_m - 0.15 if narrow else width_m / 2 - 0.1, 0.42, 0.15),
            "linen",
            0.074,
            turn("x", 18),
            segments=3,
        )
        room.box(
            at.moved(x * 0.86, -half_length_m + 0.5, 0, -side * 6.0),
            (0, 0, 0.54),
            (0.42, 0.14, 0.36),
            cushion,
            0.066,
            turn("x", 30),
            segments=3,
        )


def nightstand(room: Room, at: Frame, lamp: bool = True, material: str = "wood") -> None:
    """A bedside table with two drawers, 45 x 40 cm."""
    for x in (-1, 1):
        for y in (-1, 1):
            room.cylinder(at, (x * 0.18, y * 0.15, 0), 0.016, 0.1, "walnut")
    room.box(at, (0, 0, 0.1), (0.45, 0.4, 0.42), material, 0.008)
    for z in (0.13, 0.32):
        room.box(at, (0, 0.2, z), (0.4, 0.016, 0.17), material, 0.006)
        room.ball(at, (0, 0.22, z + 0.085), (0.014, 0.014, 0.014), "brass", slices=8)
    if lamp:
        lamps.table_lamp(room, at.moved(0, -0.04), 0.52)
    decor.stack_of_books(room, at.moved(0.11, 0.09), 0.52)
    room.block(at, (0, 0, 0.27), (0.45, 0.42, 0.54))
