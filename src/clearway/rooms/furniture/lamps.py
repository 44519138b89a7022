"""Lamps: ceiling, pendant, floor, table, wall. Each one also gives baked light."""

from __future__ import annotations

import numpy as np

from clearway.rooms.frame import Frame
from clearway.rooms.groups import CEILING_GROUP
from clearway.rooms.parts import Lamp
from clearway.rooms.room import Room

WARM = np.array([1.0, 0.9, 0.74])
NEUTRAL = np.array([1.0, 0.95, 0.87])
COOL = np.array([0.95, 0.98, 1.0])
SHADE = ((0.20, 0.0), (0.13, 0.26))


def _light(
    room: Room, at: Frame, centre_m: tuple[float, float, float], radius_m: float, colour: np.ndarray, power: float
) -> None:
    """Note a lamp for the baked light."""
    room.lamps.append(Lamp(room.place(at, centre_m), radius_m, colour, power))


def ceiling_lamp(
    room: Room, at: Frame, radius_m: float = 0.28, power: float = 1.6, colour: np.ndarray = NEUTRAL
) -> None:
    """A round glass bowl at the ceiling."""
    top = room.height_m
    _light(room, at, (0, 0, top - 0.45), 0.35, colour, power)
    bowl = [(0, 0), (radius_m * 0.6, 0.015), (radius_m * 0.92, 0.055), (radius_m, 0.1)]
    room.turned(at, (0, 0, top - 0.13), bowl, "bulb", slices=24, group=CEILING_GROUP)
    rim = [(radius_m, 0.0), (radius_m + 0.015, 0.0), (radius_m + 0.015, 0.03), (0, 0.03)]
    room.turned(at, (0, 0, top - 0.031), rim, "chrome", slices=24, group=CEILING_GROUP)


def ceiling_panel(room: Room, at: Frame, side_m: float, power: float, colour: np.ndarray) -> None:
    """A square panel of light at the ceiling."""
    top = room.height_m
    _light(room, at, (0, 0, top - 0.45), 0.35, colour, power)
    room.box(at, (0, 0, top - 0.05), (side_m, side_m, 0.05), "chrome", segments=0, group=CEILING_GROUP)
    room.box(at, (0, 0, top - 0.056), (side_m - 0.04, side_m - 0.04, 0.006), "bulb", segments=0, group=CEILING_GROUP)


def shade_lamp(room: Room, at: Frame, power: float, colour: np.ndarray) -> None:
    """A drum of cloth on a cord, under the ceiling."""
    top = room.height_m
    _light(room, at, (0, 0, top - 0.6), 0.3, colour, power)
    room.rod(at, (0, 0, top - 0.2), (0, 0, top), 0.006, "black", CEILING_GROUP)
    drum = [(0.22, 0.0), (0.22, 0.2)]
    room.turned(at, (0, 0, top - 0.4), drum, "shade", slices=24, group=CEILING_GROUP)
    room.turned(at, (0, 0, top - 0.4), drum[::-1], "shade", slices=24, group=CEILING_GROUP)
    room.ball(at, (0, 0, top - 0.3), (0.06, 0.06, 0.07), "bulb", slices=8, group=CEILING_GROUP)


def pendant(
    room: Room, at: Frame, z_m: float = 1.75, material: str = "black", power: float = 0.5, colour: np.ndarray = WARM
) -> None:
    """A metal shade on a cord; `z_m` is the height of its rim."""
    _light(room, at, (0, 0, z_m - 0.1), 0.1, colour, power)
    room.rod(at, (0, 0, z_m + 0.22), (0, 0, room.height_m), 0.006, "black", CEILING_GROUP)
    outside = [(0.2, 0), (0.17, 0.09), (0.06, 0.17), (0.022, 0.19), (0.02, 0.24), (0, 0.24)]
    inside = [(0.02, 0.186), (0.055, 0.165), (0.165, 0.085), (0.197, 0)]
    room.turned(at, (0, 0, z_m), outside, material, slices=24, group=CEILING_GROUP)
    room.turned(at, (0, 0, z_m), inside, "trim", slices=24, group=CEILING_GROUP)
    room.ball(at, (0, 0, z_m + 0.06), (0.055, 0.055, 0.06), "bulb", group=CEILING_GROUP)
    room.cylinder(at, (0, 0, room.height_m - 0.03), 0.05, 0.03, material, group=CEILING_GROUP)


def floor_lamp(room: Room, at: Frame) -> None:
    """A standard lamp with a cloth shade."""
    _light(room, at, (0, 0, 1.75), 0.1, WARM, 0.16)
    _light(room, at, (0, 0, 1.25), 0.1, WARM, 0.09)
    room.turned(at, (0, 0, 0), [(0, 0), (0.15, 0), (0.15, 0.015), (0.04, 0.03), (0.012, 0.05)], "brass")
    room.rod(at, (0, 0, 0.03), (0, 0, 1.5), 0.012, "brass")
    _shade(room, at, (0, 0, 1.36), 1.0)
    room.post(at, 0.15, 1.55)


def table_lamp(room: Room, at: Frame, z_m: float, size: float = 1.0, foot: str = "terracotta") -> None:
    """A turned foot with a cloth shade, on a table of height `z_m`."""
    _light(room, at, (0, 0, z_m + 0.55 * size), 0.06, WARM, 0.14)
    profile = [(0, 0), (0.07, 0), (0.08, 0.03), (0.03, 0.1), (0.06, 0.2), (0.015, 0.27), (0.012, 0.36)]
    room.turned(at, (0, 0, z_m), [(r * size, z * size) for r, z in profile], foot, slices=16)
    _shade(room, at, (0, 0, z_m + 0.28 * size), 0.78 * size)


def wall_lamp(room: Room, at: Frame) -> None:
    """An arm with a small shade on a wall frame."""
    _light(room, at, (0, 0.14, 0.25), 0.05, WARM, 0.12)
    room.box(at, (0, 0.012, -0.07), (0.07, 0.024, 0.14), "brass", 0.01)
    room.rod(at, (0, 0.02, 0), (0, 0.14, 0), 0.009, "brass")
    room.rod(at, (0, 0.14, 0), (0, 0.14, 0.1), 0.009, "brass")
    _shade(room, at, (0, 0.14, 0.05), 0.5)


def _shade(room: Room, at: Frame, position_m: tuple[float, float, float], size: float) -> None:
    """A cloth shade, seen from outside and inside."""
    outside = [(r * size, z * size) for r, z in SHADE]
    room.turned(at, position_m, outside, "shade", slices=24)
    room.turned(at, position_m, outside[::-1], "shade", slices=24)
    x, y, z = position_m
    room.ball(at, (x, y, z + 0.12 * size), (0.04 * size, 0.04 * size, 0.05 * size), "bulb", slices=8)
