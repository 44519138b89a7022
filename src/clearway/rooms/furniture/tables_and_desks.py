"""Dining, coffee and side tables, desks, and what lies on them."""

from __future__ import annotations

from clearway.rooms import artwork
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import decor
from clearway.rooms.room import Room


def _legs(
    room: Room,
    at: Frame,
    length_m: float,
    depth_m: float,
    height_m: float,
    inset_m: float,
    side_m: float,
    material: str,
) -> None:
    """Four square legs."""
    for x in (-1, 1):
        for y in (-1, 1):
            room.box(
                at,
                (x * (length_m / 2 - inset_m), y * (depth_m / 2 - inset_m), 0),
                (side_m, side_m, height_m),
                material,
                0.007,
            )


def dining_table(room: Room, at: Frame, length_m: float = 1.6, depth_m: float = 0.9, material: str = "wood") -> None:
    """A table with an apron; length along x. One of three things stands on it."""
    height = 0.75
    room.box(at, (0, 0, height - 0.035), (length_m, depth_m, 0.035), material, 0.01)
    _legs(room, at, length_m, depth_m, height - 0.03, 0.07, 0.06, material)
    for side in (-1, 1):
        room.box(at, (0, side * (depth_m / 2 - 0.07), height - 0.12), (length_m - 0.2, 0.02, 0.088), material, 0.004)
        room.box(at, (side * (length_m / 2 - 0.07), 0, height - 0.12), (0.02, depth_m - 0.2, 0.088), material, 0.004)
    runner = (0.36, depth_m * 0.98) if length_m < depth_m else (length_m * 0.7, 0.34)
    room.box(at, (0, 0, height), (runner[0], runner[1], 0.004), "second accent", 0.001)
    centrepiece = (decor.fruit_bowl, decor.flowers, decor.candles)[int(room.rng.integers(3))]
    centrepiece(room, at, height + 0.004)
    room.block(at, (0, 0, height / 2), (length_m, depth_m, height))


def place_setting(room: Room, at: Frame, z_m: float = 0.75) -> None:
    """A plate with a cup beside it, on a table."""
    plate = [(0, 0), (0.07, 0), (0.115, 0.018), (0.112, 0.022), (0.07, 0.008), (0, 0.008)]
    room.turned(at, (0, 0, z_m), plate, "porcelain", slices=20)
    cup = [(0, 0), (0.03, 0), (0.042, 0.08), (0.037, 0.08), (0.028, 0.015), (0, 0.015)]
    room.turned(at, (0.17, 0.05, z_m), cup, "second accent", slices=14)


def coffee_table(room: Room, at: Frame, length_m: float = 1.1, depth_m: float = 0.6, material: str = "wood") -> None:
    """A low table with a shelf, books and a bowl."""
    height = 0.42
    room.box(at, (0, 0, height - 0.04), (length_m, depth_m, 0.04), material, 0.008)
    room.box(at, (0, 0, 0.14), (length_m - 0.12, depth_m - 0.12, 0.02), material, 0.005)
    _legs(room, at, length_m, depth_m, height - 0.03, 0.05, 0.05, material)
    decor.stack_of_books(room, at.moved(0.24, 0.04), height)
    decor.stack_of_books(room, at.moved(-0.2, 0.0), 0.16)
    ornament = (decor.fruit_bowl, decor.flowers, decor.candles)[int(room.rng.integers(3))]
    ornament(room, at.moved(-0.24, 0.02), height)
    room.block(at, (0, 0, height / 2), (length_m, depth_m, height))


def side_table(room: Room, at: Frame, width_m: float = 0.45, depth_m: float = 0.45, height_m: float = 0.55) -> None:
    """A small table."""
    room.box(at, (0, 0, height_m - 0.03), (width_m, depth_m, 0.03), "wood", 0.008)
    room.box(at, (0, 0, 0.16), (width_m - 0.06, depth_m - 0.06, 0.02), "wood", 0.006)
    _legs(room, at, width_m, depth_m, height_m - 0.02, 0.04, 0.036, "wood")
    room.block(at, (0, 0, height_m / 2), (width_m, depth_m, height_m))


def desk(room: Room, at: Frame, length_m: float = 1.3, depth_m: float = 0.6, material: str = "wood") -> None:
    """A desk with drawers on the left, a monitor, a keyboard, and papers; the user sits at +y."""
    top = 0.74
    room.box(at, (0, 0, top - 0.03), (length_m, depth_m, 0.03), material, 0.006)
    left = -length_m / 2 + 0.2
    room.box(at, (left, -0.01, 0.04), (0.38, depth_m - 0.06, top - 0.06), material, 0.006)
    for number in range(3):
        room.box(at, (left, depth_m / 2 - 0.03, 0.06 + number * 0.21), (0.34, 0.016, 0.195), "white", 0.006)
        room.rod(
            at,
            (left - 0.06, depth_m / 2 - 0.01, 0.2 + number * 0.21),
            (left + 0.06, depth_m / 2 - 0.01, 0.2 + number * 0.21),
            0.007,
            "chrome",
        )
    room.box(at, (length_m / 2 - 0.03, 0, 0), (0.04, depth_m - 0.04, top - 0.03), material, 0.005)
    room.box(at, (0.05, -depth_m / 2 + 0.03, 0.35), (length_m - 0.4, 0.018, 0.36), material, 0.004)
    monitor(room, at.moved(0.15, -depth_m / 2 + 0.2), top)
    room.box(at, (0.15, 0.12, top), (0.42, 0.14, 0.015), "steel", 0.005)
    room.box(at, (0.46, 0.13, top), (0.06, 0.1, 0.025), "black", 0.012, segments=2)
    room.box(at.moved(0, 0, 0, 12), (-0.4, 0.06, top), (0.21, 0.29, 0.006), "linen", 0.001)
    decor.pot_plant(room, at.moved(-length_m / 2 + 0.14, -depth_m / 2 + 0.14), top, 0.26)
    room.block(at, (0, 0, top / 2), (length_m, depth_m, top))


def monitor(room: Room, at: Frame, z_m: float) -> None:
    """A computer screen on a foot."""
    room.box(at, (0, 0, z_m), (0.25, 0.18, 0.012), "black", 0.005)
    room.box(at, (0, -0.03, z_m), (0.05, 0.03, 0.2), "black", 0.005)
    room.box(at, (0, 0, z_m + 0.12), (0.58, 0.035, 0.36), "black", 0.007)
    room.picture(
        at, (0, 0.019, z_m + 0.3), (0.55, 0.33), lambda rng, _: artwork.screen(rng), specular=0.7, shininess=0.8
    )
