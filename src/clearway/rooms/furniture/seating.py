"""Sofas, armchairs, chairs, stools, benches."""

from __future__ import annotations

from clearway.rooms.frame import Frame, turn
from clearway.rooms.room import Room

ARM_M = 0.18


def sofa(room: Room, at: Frame, length_m: float = 2.0, depth_m: float = 0.9, material: str = "upholstery") -> None:
    """A sofa; short ones are armchairs. Origin in the middle of its footprint."""
    seats = 3 if length_m > 1.9 else 2 if length_m > 1.2 else 1
    for x in (-1.0, 1.0):
        for y in (-1, 1):
            room.cylinder(at, (x * (length_m / 2 - 0.1), y * (depth_m / 2 - 0.1), 0), 0.025, 0.1, "walnut")
    room.box(at, (0, 0, 0.1), (length_m - 0.02, depth_m - 0.02, 0.2), material, 0.03, segments=2)
    width = (length_m - 2 * ARM_M) / seats
    back_y = -depth_m / 2
    for number in range(seats):
        x = -length_m / 2 + ARM_M + width * (number + 0.5)
        room.box(at, (x, 0.1, 0.29), (width - 0.012, depth_m - 0.2, 0.16), material, 0.05, segments=3)
        room.box(at, (x, back_y + 0.24, 0.43), (width - 0.02, 0.19, 0.37), material, 0.07, turn("x", 8), segments=3)
    room.box(at, (0, back_y + 0.08, 0.1), (length_m, 0.16, 0.66), material, 0.05, segments=3)
    for side in (-1, 1):
        room.box(
            at, (side * (length_m - ARM_M) / 2, 0.02, 0.1), (ARM_M, depth_m - 0.04, 0.5), material, 0.06, segments=3
        )
    _sofa_cushions(room, at, length_m, back_y, seats)
    room.block(at, (0, 0, 0.39), (length_m, depth_m, 0.78))


def _sofa_cushions(room: Room, at: Frame, length_m: float, back_y_m: float, seats: int) -> None:
    """Loose cushions in the corners."""
    sides = (-1, 1) if seats > 1 else (0,)
    for side, material in zip(sides, ("accent", "second accent"), strict=False):
        leaning = at.moved(side * (length_m / 2 - 0.42), back_y_m + 0.4, 0, -side * 14.0)
        room.box(leaning, (0, 0, 0.46), (0.42, 0.14, 0.4), material, 0.068, turn("x", 20), segments=3)


def dining_chair(room: Room, at: Frame, material: str = "wood", seat: str = "accent") -> None:
    """A wooden chair with a padded seat and a ladder back; its back is at -y."""
    for side in (-1, 1):
        room.box(at, (side * 0.18, 0.18, 0), (0.036, 0.036, 0.43), material, 0.006)
        room.box(at, (side * 0.18, -0.18, 0), (0.036, 0.036, 0.92), material, 0.006)
        room.box(at, (side * 0.18, 0, 0.2), (0.02, 0.33, 0.025), material, 0.004)
    room.box(at, (0, 0, 0.41), (0.42, 0.42, 0.03), material, 0.008)
    room.box(at, (0, 0.012, 0.44), (0.4, 0.37, 0.045), seat, 0.02, segments=2)
    for z in (0.58, 0.7, 0.82):
        room.box(at, (0, -0.18, z), (0.34, 0.02, 0.07), material, 0.006)
    room.block(at, (0, 0, 0.46), (0.42, 0.42, 0.92))


def office_chair(room: Room, at: Frame) -> None:
    """A swivel chair."""
    for number in range(5):
        leg = at.moved(0, 0, 0, 72.0 * number)
        room.rod(leg, (0, 0, 0.09), (0, 0.25, 0.05), 0.018, "black")
        room.ball(leg, (0, 0.25, 0.03), (0.03, 0.03, 0.03), "rubber", slices=8)
    room.cylinder(at, (0, 0, 0.08), 0.028, 0.34, "chrome")
    room.box(at, (0, 0, 0.42), (0.46, 0.45, 0.08), "second accent", 0.038, segments=3)
    room.box(at, (0, -0.22, 0.56), (0.42, 0.07, 0.46), "second accent", 0.034, turn("x", 7), segments=3)
    room.box(at, (0, -0.24, 0.42), (0.06, 0.03, 0.25), "black", 0.01)
    for side in (-1, 1):
        room.box(at, (side * 0.25, -0.02, 0.6), (0.05, 0.26, 0.03), "rubber", 0.012)
        room.box(at, (side * 0.25, -0.02, 0.44), (0.025, 0.04, 0.17), "black", 0.006)
    room.block(at, (0, 0, 0.5), (0.46, 0.46, 1.0))


def bar_stool(room: Room, at: Frame, seat: str = "accent") -> None:
    """A round stool for a kitchen island."""
    room.turned(at, (0, 0, 0), [(0, 0), (0.18, 0), (0.18, 0.012), (0.05, 0.03), (0.02, 0.06)], "chrome", slices=24)
    room.cylinder(at, (0, 0, 0.03), 0.02, 0.62, "chrome")
    ring = [(0.13, 0), (0.142, 0.012), (0.13, 0.024), (0.118, 0.012), (0.13, 0)]
    room.turned(at, (0, 0, 0.24), ring, "chrome")
    for side in (-1, 1):
        room.rod(at, (0, 0, 0.252), (side * 0.13, 0, 0.252), 0.007, "chrome")
    pad = [(0, 0), (0.16, 0), (0.175, 0.02), (0.175, 0.045), (0.155, 0.065), (0, 0.07)]
    room.turned(at, (0, 0, 0.65), pad, seat, slices=24)
    room.post(at, 0.17, 0.72)


def stool(room: Room, at: Frame, height_m: float = 0.44, material: str = "pine") -> None:
    """A small three-legged stool."""
    room.cylinder(at, (0, 0, height_m - 0.035), 0.16, 0.035, material)
    for number in range(3):
        leg = at.moved(0, 0, 0, 120.0 * number)
        room.rod(leg, (0, 0.15, 0), (0, 0.1, height_m - 0.03), 0.016, material)
    room.post(at, 0.16, height_m)


def pouffe(room: Room, at: Frame, material: str = "second accent") -> None:
    """A round upholstered seat."""
    side = [(0, 0), (0.2, 0), (0.225, 0.06), (0.23, 0.2), (0.22, 0.36), (0.18, 0.4), (0, 0.42)]
    room.turned(at, (0, 0, 0), side, material, slices=24)
    room.post(at, 0.22, 0.42)
