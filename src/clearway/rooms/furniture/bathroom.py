"""Bathroom fittings."""

from __future__ import annotations

from clearway.rooms.frame import Frame, turn
from clearway.rooms.furniture.kitchen import tap
from clearway.rooms.room import Room

LYING = turn("x", -90)


def toilet(room: Room, at: Frame, depth_m: float = 0.7, width_m: float = 0.4) -> None:
    """A toilet with its cistern at -y, 40 x 70 cm, or of another depth; it blocks less than its width if need be."""
    share = depth_m / 0.7
    slim = max(0.85, width_m / 0.4)
    room.box(at, (0, -0.25 * share, 0.38), (0.38 * slim, 0.18 * share, 0.38), "porcelain", 0.03, segments=3)
    room.box(at, (0, -0.25 * share, 0.755), (0.4 * slim, 0.2 * share, 0.03), "porcelain", 0.012)
    room.cylinder(at, (0, -0.25 * share, 0.785), 0.025, 0.012, "chrome")
    bowl = [(0, 0), (0.15, 0), (0.13, 0.08), (0.12, 0.18), (0.17, 0.32), (0.2, 0.4), (0.17, 0.405), (0, 0.405)]
    room.turned(at, (0, 0.08 * share, 0), bowl, "porcelain", scale_xy=(0.92 * slim, 1.3 * share), slices=28)
    room.box(at, (0, -0.14 * share, 0), (0.25 * slim, 0.34 * share, 0.37), "porcelain", 0.04, segments=3)
    lid = [(0, 0), (0.2, 0), (0.207, 0.012), (0.2, 0.028), (0, 0.034)]
    room.turned(at, (0, 0.08 * share, 0.405), lid, "white", scale_xy=(0.92 * slim, 1.3 * share), slices=28)
    room.block(at, (0, 0, 0.4), (width_m, depth_m, 0.8))


def basin(room: Room, at: Frame, width_m: float = 0.5, depth_m: float = 0.45) -> None:
    """A basin on a foot, with its tap at -y."""
    top = 0.84
    foot = [(0, 0), (0.13, 0), (0.1, 0.1), (0.075, 0.5), (0.1, 0.72), (0, 0.72)]
    room.turned(at, (0, -0.06, 0), foot, "porcelain", slices=20)
    bowl = [(0, 0), (0.08, 0), (0.19, 0.1), (0.2, 0.14), (0.18, 0.14), (0.1, 0.05), (0, 0.045)]
    scale = (max(width_m, 0.34) / 0.4, (depth_m - 0.04) / 0.4)
    room.turned(at, (0, 0, top - 0.14), bowl, "porcelain", scale_xy=scale, slices=28)
    room.box(at, (0, -depth_m / 2 + 0.06, top - 0.12), (0.3, 0.11, 0.13), "porcelain", 0.03, segments=2)
    tap(room, at.moved(0, -depth_m / 2 + 0.06), top, 0.18, 0.13)
    room.block(at, (0, 0, top / 2), (width_m, depth_m, top))


def bathtub(room: Room, at: Frame, length_m: float = 1.7, width_m: float = 0.75) -> None:
    """A panelled tub with water in it, length along x, tap at -x."""
    height, rim = 0.56, 0.09
    for side in (-1, 1):
        room.box(at, (0, side * (width_m - rim) / 2, 0), (length_m, rim, height), "porcelain", 0.03, segments=2)
        room.box(at, (side * (length_m - rim) / 2, 0, 0), (rim, width_m, height), "porcelain", 0.03, segments=2)
    room.box(at, (0, 0, 0.1), (length_m - 0.1, width_m - 0.1, 0.1), "porcelain", 0.02)
    room.box(at, (0, 0, 0.2), (length_m - 0.15, width_m - 0.15, 0.2), "water", segments=0)
    room.box(at, (0, width_m / 2 - 0.004, 0.06), (length_m - 0.12, 0.016, 0.38), "trim", 0.01)
    tap(room, at.moved(-length_m / 2 + 0.045, 0, 0, -90), height, 0.14, 0.13)
    room.cylinder(at, (length_m / 2 - 0.05, width_m / 2 - 0.045, height), 0.028, 0.15, "accent")
    room.cylinder(at, (length_m / 2 - 0.12, width_m / 2 - 0.045, height), 0.022, 0.12, "yellow")
    room.block(at, (0, 0, height / 2), (length_m, width_m, height))


def vanity(room: Room, at: Frame, width_m: float = 1.2, depth_m: float = 0.48) -> None:
    """A washstand with a bowl on a marble top."""
    top = 0.84
    room.box(at, (0, -0.008, 0.2), (width_m - 0.02, depth_m - 0.03, top - 0.24), "wood", 0.006)
    room.box(at, (0, 0, top - 0.04), (width_m, depth_m, 0.04), "marble", 0.01)
    for x in (-1.0, 1.0):
        for y in (-1, 1):
            room.cylinder(at, (x * (width_m / 2 - 0.07), y * (depth_m / 2 - 0.08), 0), 0.018, 0.21, "chrome")
    count = max(2, int(width_m / 0.45))
    wide = (width_m - 0.02) / count
    for number in range(count):
        x = -width_m / 2 + 0.01 + wide * (number + 0.5)
        for z, tall in ((0.22, 0.29), (0.52, 0.27)):
            room.box(at, (x, depth_m / 2 - 0.018, z), (wide - 0.014, 0.018, tall), "wood", 0.006)
            room.rod(
                at,
                (x - 0.07, depth_m / 2 + 0.008, z + tall - 0.05),
                (x + 0.07, depth_m / 2 + 0.008, z + tall - 0.05),
                0.007,
                "chrome",
            )
    bowl = [(0, 0), (0.1, 0), (0.19, 0.09), (0.21, 0.13), (0.195, 0.13), (0.1, 0.03), (0, 0.025)]
    room.turned(at, (0, 0.03, top), bowl, "porcelain", scale_xy=(1.15, 0.85), slices=28)
    tap(room, at.moved(0, -0.18), top, 0.25, 0.14)
    bottles(room, at.moved(width_m / 2 - 0.2, -0.1), top)
    room.block(at, (0, 0, top / 2), (width_m, depth_m, top))


def bottles(room: Room, at: Frame, z_m: float) -> None:
    """Three bottles and a cup with a brush."""
    shape = [(0, 0), (0.028, 0), (0.03, 0.1), (0.012, 0.14), (0.012, 0.17), (0, 0.17)]
    for number, material in enumerate(("terracotta", "second accent", "green")):
        room.turned(at, (-0.075 * number, 0, z_m), shape, material, slices=12)
    cup = [(0, 0), (0.032, 0), (0.036, 0.1), (0.03, 0.1), (0.026, 0.02), (0, 0.02)]
    room.turned(at, (0.1, 0.02, z_m), cup, "porcelain", slices=14)
    room.rod(at, (0.1, 0.02, z_m + 0.02), (0.125, 0.03, z_m + 0.19), 0.005, "blue")


def shower(room: Room, at: Frame, width_m: float = 0.95, depth_m: float = 0.95, height_m: float = 2.0) -> None:
    """A corner shower: walls at -x and -y, glass at +x and +y."""
    room.box(at, (0, 0, 0), (width_m, depth_m, 0.08), "porcelain", 0.02)
    room.cylinder(at, (0, 0, 0.079), 0.05, 0.004, "chrome")
    half_x, half_y = width_m / 2, depth_m / 2
    for x, y, size_x, size_y in ((0, half_y - 0.01, width_m, 0.01), (half_x - 0.01, 0, 0.01, depth_m)):
        room.box(at, (x, y, 0.09), (size_x, size_y, height_m - 0.1), "glass", segments=0)
    for x, y in (
        (-half_x + 0.012, half_y - 0.012),
        (half_x - 0.012, half_y - 0.012),
        (half_x - 0.012, -half_y + 0.012),
    ):
        room.box(at, (x, y, 0.07), (0.024, 0.024, height_m - 0.05), "chrome", 0.004)
    room.box(at, (0, half_y - 0.012, height_m), (width_m, 0.028, 0.028), "chrome", 0.004)
    room.box(at, (half_x - 0.012, 0, height_m), (0.028, depth_m, 0.028), "chrome", 0.004)
    room.rod(at, (0.12, half_y + 0.03, 0.95), (0.12, half_y + 0.03, 1.3), 0.01, "chrome")
    _shower_head(room, at.moved(-half_x, -0.05))
    room.block(at, (0, 0, height_m / 2), (width_m, depth_m, height_m))


def _shower_head(room: Room, at: Frame) -> None:
    """A riser with a rain head and a mixer, on a wall at the frame's x = 0."""
    room.rod(at, (0.05, 0, 1.0), (0.05, 0, 2.05), 0.012, "chrome")
    room.rod(at, (0.05, 0, 2.05), (0.34, 0, 2.05), 0.011, "chrome")
    room.turned(at, (0.34, 0, 1.98), [(0, 0), (0.1, 0), (0.1, 0.012), (0.03, 0.03), (0.015, 0.07)], "chrome")
    room.rod(at, (0.04, -0.1, 1.02), (0.04, 0.1, 1.02), 0.02, "chrome")


def towel_rail(room: Room, at: Frame, towel: str = "accent") -> None:
    """A heated rail with a towel, on a wall frame."""
    for side in (-1, 1):
        room.rod(at, (side * 0.24, 0.06, 0.7), (side * 0.24, 0.06, 1.72), 0.014, "chrome")
        for z in (0.8, 1.62):
            room.rod(at, (side * 0.24, 0, z), (side * 0.24, 0.06, z), 0.01, "chrome")
    for number in range(9):
        room.rod(at, (-0.24, 0.06, 0.76 + 0.112 * number), (0.24, 0.06, 0.76 + 0.112 * number), 0.01, "chrome")
    room.box(at, (0, 0.068, 0.96), (0.4, 0.05, 0.5), towel, 0.02, segments=2)


def towel_ring(room: Room, at: Frame, towel: str = "second accent") -> None:
    """A short bar with a hand towel, on a wall frame."""
    room.rod(at, (-0.16, 0.06, 0), (0.16, 0.06, 0), 0.008, "chrome")
    for side in (-1, 1):
        room.rod(at, (side * 0.16, 0, 0), (side * 0.16, 0.065, 0), 0.009, "chrome")
    room.box(at, (0, 0.06, -0.4), (0.24, 0.04, 0.42), towel, 0.018, segments=2)


def paper_holder(room: Room, at: Frame) -> None:
    """A roll of paper on a wall frame."""
    room.box(at, (0, 0.01, 0.04), (0.12, 0.02, 0.03), "chrome", 0.006)
    room.rod(at, (-0.07, 0.06, 0.0), (0.07, 0.06, 0.0), 0.008, "chrome")
    room.rod(at, (-0.05, 0.06, 0.0), (0.05, 0.06, 0.0), 0.05, "linen")


def washing_machine(room: Room, at: Frame) -> None:
    """A front loader, 60 x 56 cm."""
    room.box(at, (0, -0.006, 0.02), (0.6, 0.548, 0.83), "white", 0.015)
    room.box(at, (0, 0.27, 0.7), (0.56, 0.014, 0.12), "steel", 0.006)
    ring = [(0, 0), (0.2, 0), (0.2, 0.025), (0.16, 0.035), (0.15, 0.02), (0, 0.02)]
    room.turned(at, (0, 0.266, 0.42), ring, "chrome", LYING, slices=28)
    room.turned(at, (0, 0.278, 0.42), [(0, 0), (0.15, 0), (0.13, 0.02), (0, 0.035)], "black", LYING, slices=28)
    room.cylinder(at, (0.12, 0.275, 0.76), 0.032, 0.02, "chrome", LYING)
    room.box(at, (-0.18, 0.274, 0.73), (0.14, 0.012, 0.06), "rubber", 0.004)
    room.box(at, (-0.1, 0, 0.85), (0.3, 0.3, 0.14), "accent", 0.03, segments=2)
    room.box(at, (0.18, -0.05, 0.85), (0.1, 0.08, 0.22), "blue", 0.02, segments=2)
    room.block(at, (0, 0, 0.43), (0.6, 0.56, 0.86))
