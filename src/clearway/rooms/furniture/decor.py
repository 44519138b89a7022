"""Things that make a room lived in: pictures, clocks, shelves, plants, vases, books, bowls."""

from __future__ import annotations

import math

import numpy as np

from clearway.rooms import artwork
from clearway.rooms.frame import Frame, along, turn
from clearway.rooms.room import Room

LYING = turn("x", -90)
VASES = (
    ((0, 0), (0.05, 0), (0.075, 0.07), (0.05, 0.15), (0.03, 0.19), (0.04, 0.22), (0.03, 0.215), (0, 0.15)),
    ((0, 0), (0.04, 0), (0.055, 0.12), (0.055, 0.18), (0.03, 0.21), (0.03, 0.25), (0.022, 0.245), (0, 0.2)),
    ((0, 0), (0.05, 0), (0.09, 0.06), (0.09, 0.09), (0.05, 0.13), (0.04, 0.125), (0, 0.1)),
)
VASE_MATERIALS = ("terracotta", "porcelain", "blue", "second accent", "cream")


def painting(room: Room, at: Frame, width_m: float, height_m: float, frame: str = "black") -> None:
    """A framed picture on a wall frame, centred on it."""
    room.picture(
        at,
        (0, 0.02, 0),
        (width_m, height_m),
        lambda rng, step: artwork.painting(rng, 256, round(256 * width_m / height_m), step),
        specular=0.1,
    )
    _border(room, at, width_m, height_m, 0.03, frame)


def _border(room: Room, at: Frame, width_m: float, height_m: float, thick_m: float, material: str) -> None:
    """Four bars around a rectangle on a wall."""
    for side in (-1, 1):
        room.box(
            at,
            (side * (width_m + thick_m) / 2, 0.017, -height_m / 2 - thick_m),
            (thick_m, 0.034, height_m + 2 * thick_m),
            material,
            0.005,
        )
    for z in (-height_m / 2 - thick_m, height_m / 2):
        room.box(at, (0, 0.017, z), (width_m, 0.033, thick_m), material, 0.005)


def mirror(room: Room, at: Frame, width_m: float, height_m: float, frame: str = "walnut") -> None:
    """A framed mirror on a wall frame, centred on it."""
    room.mirror_glass(at, (0, 0.016, 0), (width_m, height_m))
    _border(room, at, width_m, height_m, 0.035, frame)


def clock(room: Room, at: Frame, radius_m: float = 0.16, frame: str = "black") -> None:
    """A round clock on a wall frame."""
    rim = [(0, 0), (radius_m, 0), (radius_m, 0.035), (radius_m - 0.02, 0.04), (radius_m - 0.02, 0.02), (0, 0.02)]
    room.turned(at, (0, 0, 0), rim, frame, LYING, slices=28)
    side = 1.32 * radius_m
    room.picture(at, (0, 0.024, 0), (side, side), lambda rng, _: artwork.clock(rng), specular=0.2)


def wall_shelf(room: Room, at: Frame, width_m: float = 0.8, material: str = "wood") -> None:
    """A board on brackets with books and an ornament, on a wall frame; hangs above head height or over furniture."""
    depth = 0.2
    room.box(at, (0, depth / 2, 0), (width_m, depth, 0.025), material, 0.004)
    for side in (-1, 1):
        room.box(at, (side * (width_m / 2 - 0.08), depth / 2 - 0.02, -0.06), (0.02, depth - 0.05, 0.06), "black", 0.004)
    shelf = at.moved(-width_m / 5, depth / 2, 0.025)
    row_of_books(room, shelf, width_m * 0.5, 0.24, depth - 0.03)
    ornament(room, at.moved(width_m * 0.3, depth / 2), 0.025)


def row_of_books(room: Room, at: Frame, width_m: float, height_m: float, depth_m: float) -> None:
    """Books side by side, centred on the frame, spines to +y."""
    room.picture(
        at,
        (0, depth_m / 2 + 0.003, height_m / 2),
        (width_m, height_m),
        lambda rng, _: artwork.books(rng, 112, max(48, round(112 * width_m / height_m))),
        specular=0.1,
    )
    room.box(at, (0, 0, 0), (width_m, depth_m, height_m * 0.66), "linen", 0.004, segments=0)


def ornament(room: Room, at: Frame, z_m: float) -> None:
    """A vase, a small box or a ball, chosen by the room's generator."""
    kind = int(room.rng.integers(5))
    material = str(room.rng.choice(VASE_MATERIALS))
    if kind < 3:
        room.turned(at, (0, 0, z_m), VASES[kind], material, slices=16)
    elif kind == 3:
        room.box(at, (0, 0, z_m), (0.2, 0.14, 0.1), "pine", 0.008)
        room.box(at, (0, 0, z_m + 0.1), (0.21, 0.15, 0.02), "pine", 0.006)
    else:
        room.ball(at, (0, 0, z_m + 0.07), (0.07, 0.07, 0.07), material)


def stack_of_books(room: Room, at: Frame, z_m: float) -> None:
    """Two or three books lying on one another."""
    height = z_m
    for material in ("accent", "linen", "second accent")[: int(room.rng.integers(2, 4))]:
        lying = at.moved(0, 0, 0, float(room.rng.uniform(-18, 18)))
        thick = float(room.rng.choice([0.022, 0.03]))
        room.box(lying, (0, 0, height), (0.25 - (height - z_m), 0.18, thick), material, 0.004)
        height += thick


def fruit_bowl(room: Room, at: Frame, z_m: float, size: float = 1.0) -> None:
    """A bowl with fruit."""
    bowl = [(0, 0), (0.07, 0), (0.14, 0.06), (0.16, 0.1), (0.148, 0.1), (0.08, 0.025), (0, 0.02)]
    room.turned(at, (0, 0, z_m), [(r * size, z * size) for r, z in bowl], "porcelain", slices=24)
    for number, material in enumerate(("red", "yellow", "green", "red", "yellow")):
        angle = number * 1.26
        x, y = 0.065 * size * math.cos(angle), 0.065 * size * math.sin(angle)
        room.ball(at, (x, y, z_m + 0.08 * size), (0.038 * size,) * 3, material, slices=10)


def flowers(room: Room, at: Frame, z_m: float) -> None:
    """A vase with flowers."""
    room.turned(at, (0, 0, z_m), VASES[1], str(room.rng.choice(("porcelain", "blue", "cream"))), slices=16)
    blossom = str(room.rng.choice(("red", "yellow", "white", "accent")))
    for _ in range(7):
        angle, lean = room.rng.uniform(0, 2 * math.pi), room.rng.uniform(0.02, 0.11)
        tip = (lean * math.cos(angle), lean * math.sin(angle), z_m + room.rng.uniform(0.36, 0.48))
        room.rod(at, (0, 0, z_m + 0.2), tip, 0.004, "leaf")
        room.ball(at, tip, (0.03, 0.03, 0.022), blossom, slices=8)


def plant(room: Room, at: Frame, height_m: float = 1.2, pot: str = "terracotta") -> None:
    """A leafy plant in a pot that stands on the floor."""
    _pot(room, at, 0.0, 0.19, 0.33, pot)
    _leaves(room, at, 0.3, height_m, 26, 0.24)
    room.post(at, 0.2, max(1.0, 0.8 * height_m))


def pot_plant(room: Room, at: Frame, z_m: float, height_m: float = 0.32) -> None:
    """A small plant for a table or a sill."""
    _pot(room, at, z_m, 0.07, 0.11, str(room.rng.choice(("terracotta", "porcelain", "cream"))))
    _leaves(room, at, z_m + 0.1, height_m, 12, 0.17)


def _pot(room: Room, at: Frame, z_m: float, radius_m: float, height_m: float, material: str) -> None:
    shape = [(0, 0), (0.7, 0), (0.94, 0.88), (1, 0.88), (1, 1), (0.88, 1), (0.84, 0.85)]
    room.turned(at, (0, 0, z_m), [(r * radius_m, z * height_m) for r, z in shape], material, slices=20)
    room.cylinder(at, (0, 0, z_m + height_m * 0.8), radius_m * 0.86, height_m * 0.06, "soil")


def _leaves(room: Room, at: Frame, z_m: float, height_m: float, count: int, reach_m: float) -> None:
    """Pointed leaves that rise from one place and lean outwards, at most `reach_m` to the side."""
    rng = room.rng
    half_width = 0.022 + 0.02 * height_m
    for number in range(count):
        around, rise = number * 2.4 + rng.uniform(-0.3, 0.3), rng.uniform(0.45, 1.45)
        direction = np.array([math.cos(around) * math.cos(rise), math.sin(around) * math.cos(rise), math.sin(rise)])
        longest = (reach_m - half_width) / (1.95 * math.cos(rise))
        length = min(height_m * rng.uniform(0.2, 0.34), longest)
        stem = height_m * rng.uniform(0.0, 0.32) * math.sin(rise)
        x, y, z = np.array([0, 0, z_m + stem]) + direction * length * 0.95
        green = str(rng.choice(("leaf", "young leaf")))
        room.ball(at, (x, y, z), (half_width, 0.007, length), green, along(direction), 8)


def basket(room: Room, at: Frame, height_m: float = 0.5, material: str = "basket") -> None:
    """A round basket or bin on the floor."""
    wall = [(0, 0), (0.15, 0), (0.185, height_m), (0.17, height_m), (0.14, height_m * 0.25), (0, height_m * 0.25)]
    room.turned(at, (0, 0, 0), wall, material, slices=24)
    if material == "basket":
        room.ball(at, (0, 0, height_m * 0.8), (0.15, 0.15, 0.09), str(room.rng.choice(("linen", "accent"))))
    room.post(at, 0.18, height_m)


def hooks(room: Room, at: Frame, towels: tuple[str, ...] = ("accent", "linen")) -> None:
    """A board with hooks on a wall frame and cloths hanging from some of them."""
    width = 0.22 * (len(towels) + 1)
    room.box(at, (0, 0.012, 0), (width, 0.024, 0.09), "wood", 0.006)
    for number in range(len(towels) + 1):
        x = -width / 2 + 0.11 + 0.22 * number
        room.rod(at, (x, 0.02, 0.03), (x, 0.075, 0.045), 0.008, "brass")
        if number < len(towels):
            room.cloth(at, (x, 0.05, -0.72), (0.19, 0.76), 3, towels[number])


def candles(room: Room, at: Frame, z_m: float) -> None:
    """Three candles of different heights on a tray."""
    room.box(at, (0, 0, z_m), (0.34, 0.16, 0.015), "walnut", 0.005)
    for x, height in ((-0.1, 0.12), (0.0, 0.18), (0.1, 0.09)):
        room.cylinder(at, (x, 0, z_m + 0.015), 0.028, height, "cream")
