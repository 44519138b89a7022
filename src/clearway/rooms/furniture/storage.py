"""Bookcases, wardrobes, sideboards, chests of drawers, television units, room dividers."""

from __future__ import annotations

from clearway.rooms import artwork
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import decor
from clearway.rooms.room import Room

BOARD_M = 0.024


def bookcase(
    room: Room,
    at: Frame,
    width_m: float = 0.9,
    height_m: float = 1.9,
    depth_m: float = 0.32,
    material: str = "wood",
    shelves: int = 5,
    open_back: bool = False,
) -> None:
    """Shelves with books and ornaments; with an open back it divides a room."""
    for side in (-1, 1):
        room.box(at, (side * (width_m - BOARD_M) / 2, 0, 0), (BOARD_M, depth_m, height_m), material, 0.004)
    if not open_back:
        room.box(at, (0, -depth_m / 2 + 0.006, 0.02), (width_m - BOARD_M, 0.012, height_m - 0.03), material, segments=0)
    gap = (height_m - BOARD_M) / shelves
    for number in range(shelves + 1):
        room.box(at, (0, 0, number * gap), (width_m - 2 * BOARD_M, depth_m - 0.01, BOARD_M), material, 0.003)
    for number in range(shelves):
        _fill_shelf(room, at, number * gap + BOARD_M, width_m - 2 * BOARD_M - 0.01, gap - BOARD_M, depth_m)
    room.block(at, (0, 0, height_m / 2), (width_m, depth_m, height_m))


def _fill_shelf(room: Room, at: Frame, z_m: float, width_m: float, gap_m: float, depth_m: float) -> None:
    """Books, and where they leave room an ornament; or a box with an ornament."""
    side = int(room.rng.choice((-1, 1)))
    if room.rng.random() < 0.75:
        taken = width_m * float(room.rng.choice((0.55, 0.68, 0.98)))
        shift = side * (width_m - taken) / 2
        decor.row_of_books(room, at.moved(shift, -0.02, z_m), taken, min(gap_m * 0.9, 0.32), depth_m - 0.09)
        if taken < 0.9 * width_m and gap_m > 0.26 and width_m - taken > 0.2:
            decor.ornament(room, at.moved(-side * taken / 2, 0), z_m)
        return
    decor.ornament(room, at.moved(side * width_m * 0.22, 0), z_m)
    size = (min(0.3, width_m * 0.4), depth_m * 0.75, min(0.2, gap_m * 0.7))
    room.box(at, (-side * width_m * 0.24, 0, z_m), size, "basket", 0.02)


def wardrobe(
    room: Room, at: Frame, width_m: float = 1.6, height_m: float = 2.1, depth_m: float = 0.58, material: str = "wood"
) -> None:
    """A wardrobe with doors about half a metre wide."""
    room.box(at, (0, -0.012, 0.06), (width_m, depth_m - 0.024, height_m - 0.06), material, 0.006)
    room.box(at, (0, -0.03, 0), (width_m - 0.06, depth_m - 0.1, 0.07), "walnut", 0.004)
    room.box(at, (0, 0, height_m), (width_m + 0.03, depth_m + 0.02, 0.04), material, 0.01)
    count = max(2, round(width_m / 0.5))
    leaf = width_m / count
    for number in range(count):
        x = -width_m / 2 + leaf * (number + 0.5)
        inner = 1 if number % 2 == 0 else -1
        room.box(at, (x, depth_m / 2 - 0.022, 0.08), (leaf - 0.012, 0.022, height_m - 0.1), "white", 0.006)
        for z, tall in ((0.18, 0.7), (0.98, height_m - 1.12)):
            room.box(at, (x, depth_m / 2 - 0.004, z), (leaf - 0.16, 0.012, tall), "white", 0.01)
        room.rod(
            at,
            (x + inner * (leaf / 2 - 0.05), depth_m / 2 + 0.02, 0.95),
            (x + inner * (leaf / 2 - 0.05), depth_m / 2 + 0.02, 1.15),
            0.009,
            "brass",
        )
    room.block(at, (0, 0, height_m / 2), (width_m, depth_m, height_m))


def drawers(
    room: Room,
    at: Frame,
    width_m: float = 1.0,
    height_m: float = 0.85,
    depth_m: float = 0.44,
    rows: int = 3,
    columns: int = 2,
    material: str = "wood",
    front: str | None = None,
) -> None:
    """A chest of drawers on short feet."""
    for x in (-1.0, 1.0):
        for y in (-1, 1):
            room.cylinder(at, (x * (width_m / 2 - 0.06), y * (depth_m / 2 - 0.06), 0), 0.02, 0.1, "walnut")
    room.box(at, (0, -0.008, 0.09), (width_m - 0.02, depth_m - 0.016, height_m - 0.11), material, 0.006)
    room.box(at, (0, 0, height_m - 0.03), (width_m, depth_m, 0.03), material, 0.008)
    tall, wide = (height_m - 0.15) / rows, (width_m - 0.05) / columns
    for row in range(rows):
        for column in range(columns):
            x = -width_m / 2 + 0.025 + wide * (column + 0.5)
            z = 0.105 + tall * row
            room.box(at, (x, depth_m / 2 - 0.014, z), (wide - 0.014, 0.018, tall - 0.014), front or material, 0.006)
            room.ball(at, (x, depth_m / 2 + 0.016, z + tall / 2), (0.016, 0.016, 0.016), "brass", slices=8)
    room.block(at, (0, 0, height_m / 2), (width_m, depth_m, height_m))


def sideboard(
    room: Room, at: Frame, width_m: float = 1.4, height_m: float = 0.8, depth_m: float = 0.42, material: str = "wood"
) -> None:
    """A low cupboard with doors, and things on top."""
    room.box(at, (0, -0.008, 0.1), (width_m - 0.02, depth_m - 0.016, height_m - 0.13), material, 0.006)
    room.box(at, (0, 0, height_m - 0.03), (width_m, depth_m, 0.03), material, 0.008)
    for x in (-1.0, 1.0):
        for y in (-1, 1):
            room.box(at, (x * (width_m / 2 - 0.06), y * (depth_m / 2 - 0.06), 0), (0.04, 0.04, 0.11), material, 0.005)
    count = max(2, round(width_m / 0.45))
    leaf = (width_m - 0.04) / count
    for number in range(count):
        x = -width_m / 2 + 0.02 + leaf * (number + 0.5)
        room.box(
            at, (x, depth_m / 2 - 0.014, 0.12), (leaf - 0.014, 0.018, height_m - 0.17), material, 0.006, grain_up=False
        )
        room.box(at, (x, depth_m / 2 - 0.002, 0.17), (leaf - 0.12, 0.012, height_m - 0.27), material, 0.008)
        room.ball(
            at,
            (x + (leaf / 2 - 0.035) * (1 if number % 2 == 0 else -1), depth_m / 2 + 0.014, height_m * 0.55),
            (0.014, 0.014, 0.014),
            "brass",
            slices=8,
        )
    decor.ornament(room, at.moved(-width_m * 0.32, 0), height_m)
    decor.stack_of_books(room, at.moved(width_m * 0.05, 0), height_m)
    decor.pot_plant(room, at.moved(width_m * 0.34, 0), height_m)
    room.block(at, (0, 0, height_m / 2), (width_m, depth_m, height_m))


def television(room: Room, at: Frame, width_m: float = 1.8, depth_m: float = 0.42, material: str = "walnut") -> None:
    """A low unit with a television on it."""
    room.box(at, (0, 0, 0), (width_m - 0.1, depth_m - 0.08, 0.08), "black", 0.004)
    room.box(at, (0, -0.006, 0.08), (width_m, depth_m - 0.012, 0.4), material, 0.006)
    for number in range(3):
        x = (number - 1) * width_m / 3
        front = material if number == 1 else "white"
        room.box(at, (x, depth_m / 2 - 0.012, 0.11), (width_m / 3 - 0.03, 0.016, 0.34), front, 0.005)
        room.rod(at, (x - 0.07, depth_m / 2 + 0.012, 0.38), (x + 0.07, depth_m / 2 + 0.012, 0.38), 0.007, "chrome")
    room.box(at, (0, 0, 0.48), (0.42, 0.2, 0.015), "black", 0.005)
    room.box(at, (0, 0, 0.49), (0.07, 0.04, 0.08), "black", 0.005)
    room.box(at, (0, 0, 0.56), (1.15, 0.045, 0.67), "black", 0.01)
    room.picture(at, (0, 0.025, 0.895), (1.11, 0.63), lambda rng, _: artwork.screen(rng), specular=0.6, shininess=0.8)
    decor.ornament(room, at.moved(-width_m / 2 + 0.14, 0), 0.48)
    decor.candles(room, at.moved(width_m / 2 - 0.18, 0.05), 0.48)
    room.block(at, (0, 0, 0.62), (width_m, depth_m, 1.24))


def fireplace(room: Room, at: Frame, width_m: float = 1.3, depth_m: float = 0.42) -> None:
    """A brick chimneypiece with a mantel, logs and embers; stands against a wall at -y."""
    height, jamb = 1.1, 0.3
    for side in (-1, 1):
        room.box(
            at, (side * (width_m - jamb) / 2, -0.01, 0), (jamb, depth_m - 0.02, height), "brick", 0.006, grain_up=True
        )
    room.box(at, (0, -0.01, 0.72), (width_m - 2 * jamb, depth_m - 0.02, height - 0.72), "brick", 0.006, grain_up=True)
    room.box(at, (0, -depth_m / 2 + 0.03, 0), (width_m - 2 * jamb, 0.04, 0.73), "soot", segments=0)
    room.box(at, (0, 0.0, 0), (width_m - 2 * jamb, depth_m - 0.04, 0.05), "granite", segments=0)
    room.box(at, (0, 0, height), (width_m + 0.08, depth_m, 0.06), "walnut", 0.012)
    for x, y, z, turn_deg in ((0.0, 0.02, 0.1, 8), (0.02, -0.07, 0.1, -6), (-0.01, -0.02, 0.18, 14)):
        log = at.moved(x, y, z, turn_deg)
        room.rod(log, (-0.22, 0, 0), (0.22, 0, 0), 0.045, "bark")
    room.ball(at, (0, -0.02, 0.08), (0.2, 0.1, 0.05), "ember")
    decor.ornament(room, at.moved(-0.42, 0), height + 0.06)
    decor.candles(room, at.moved(0.3, 0), height + 0.06)
    room.block(at, (0, 0, 0.58), (width_m, depth_m, 1.16))
