"""Kitchen fittings: base and wall cabinets, island, cooker, fridge, sink, small appliances."""

from __future__ import annotations

from clearway.rooms.frame import Frame, turn
from clearway.rooms.room import Room

WORKTOP_M = 0.9
DEPTH_M = 0.6
LYING = turn("x", -90)


def counter(
    room: Room,
    at: Frame,
    length_m: float,
    top: str = "granite",
    depth_m: float = DEPTH_M,
    every_second_drawers: bool = True,
    front: str = "cabinet",
) -> None:
    """Base cabinets under a worktop; the frame's origin is the middle of the footprint."""
    room.box(at, (0, -0.02, 0.09), (length_m, depth_m - 0.05, WORKTOP_M - 0.13), front, segments=0)
    room.box(at, (0, -0.05, 0), (length_m - 0.01, depth_m - 0.12, 0.1), "rubber", segments=0)
    room.box(at, (0, 0, WORKTOP_M - 0.04), (length_m, depth_m, 0.04), top, 0.008)
    _fronts(room, at, length_m, depth_m / 2 - 0.035, every_second_drawers, front)
    room.block(at, (0, 0, WORKTOP_M / 2), (length_m, depth_m, WORKTOP_M))


def _fronts(room: Room, at: Frame, length_m: float, y_m: float, drawers: bool, front: str) -> None:
    """Doors, and drawers at every second place, about 55 cm wide."""
    count = max(1, round(length_m / 0.55))
    wide = length_m / count
    for number in range(count):
        x = -length_m / 2 + wide * (number + 0.5)
        if drawers and number % 2 == 0:
            for z, tall in ((0.11, 0.3), (0.42, 0.22), (0.65, 0.2)):
                room.box(at, (x, y_m, z), (wide - 0.01, 0.02, tall - 0.01), front, 0.005)
                _handle(room, at.moved(x, y_m + 0.03), z + tall - 0.06, wide * 0.4, upright=False)
        else:
            room.box(at, (x, y_m, 0.11), (wide - 0.01, 0.02, 0.73), front, 0.005)
            room.box(at, (x, y_m + 0.006, 0.19), (wide - 0.15, 0.02, 0.57), front, 0.008)
            _handle(room, at.moved(x + (wide / 2 - 0.045) * (1 if number % 2 else -1), y_m + 0.03), 0.6, 0.16)


def _handle(room: Room, at: Frame, z_m: float, length_m: float, upright: bool = True) -> None:
    """A bar handle; upright ones start at `z_m`."""
    if upright:
        room.rod(at, (0, 0, z_m), (0, 0, z_m + length_m), 0.007, "chrome")
    else:
        room.rod(at, (-length_m / 2, 0, z_m), (length_m / 2, 0, z_m), 0.007, "chrome")


def wall_cabinets(
    room: Room, at: Frame, length_m: float, z_m: float = 1.42, height_m: float = 0.72, front: str = "cabinet"
) -> None:
    """Cabinets on a wall frame, 34 cm deep."""
    depth = 0.34
    room.box(at, (0, depth / 2 - 0.01, z_m), (length_m, depth - 0.02, height_m), front, segments=0)
    count = max(1, round(length_m / 0.5))
    wide = length_m / count
    for number in range(count):
        x = -length_m / 2 + wide * (number + 0.5)
        room.box(at, (x, depth - 0.01, z_m), (wide - 0.008, 0.02, height_m), front, 0.005)
        room.box(at, (x, depth - 0.004, z_m + 0.08), (wide - 0.15, 0.02, height_m - 0.16), front, 0.008)
        _handle(room, at.moved(x + (wide / 2 - 0.045) * (1 if number % 2 else -1), depth + 0.02), z_m + 0.05, 0.14)
    room.block(at, (0, depth / 2, z_m + height_m / 2), (length_m, depth, height_m))


def fridge(room: Room, at: Frame, width_m: float = 0.7, depth_m: float = 0.62) -> None:
    """A tall fridge with a freezer below."""
    front = depth_m / 2
    room.box(at, (0, -0.02, 0.03), (width_m, depth_m - 0.04, 1.82), "steel", 0.012)
    room.box(at, (0, front - 0.02, 0.05), (width_m - 0.01, 0.04, 0.62), "steel", 0.012, segments=2)
    room.box(at, (0, front - 0.02, 0.69), (width_m - 0.01, 0.04, 1.15), "steel", 0.012, segments=2)
    room.box(at, (0, -0.02, 0), (width_m - 0.08, depth_m - 0.1, 0.04), "rubber", segments=0)
    for z, tall in ((0.36, 0.26), (0.78, 0.5)):
        room.rod(
            at, (-width_m / 2 + 0.06, front + 0.035, z), (-width_m / 2 + 0.06, front + 0.035, z + tall), 0.012, "chrome"
        )
        for end in (z + 0.02, z + tall - 0.02):
            room.rod(
                at, (-width_m / 2 + 0.06, front - 0.01, end), (-width_m / 2 + 0.06, front + 0.035, end), 0.008, "chrome"
            )
    room.block(at, (0, 0, 0.93), (width_m, depth_m, 1.86))


def cooker(room: Room, at: Frame, width_m: float = 0.6) -> None:
    """An oven with four rings and a pot, 60 cm deep."""
    front = DEPTH_M / 2
    room.box(at, (0, -0.02, 0.04), (width_m - 0.006, DEPTH_M - 0.06, 0.84), "steel", 0.006)
    room.box(at, (0, -0.05, 0), (width_m - 0.04, DEPTH_M - 0.14, 0.05), "rubber", segments=0)
    room.box(at, (0, 0, 0.88), (width_m - 0.006, DEPTH_M, 0.024), "black", 0.006)
    for x in (-0.14, 0.14):
        for y in (-0.14, 0.14):
            room.cylinder(at, (x, y, 0.904), 0.085, 0.004, "steel")
            room.cylinder(at, (x, y, 0.906), 0.06, 0.004, "rubber")
    room.box(at, (0, front - 0.04, 0.16), (width_m - 0.04, 0.024, 0.5), "steel", 0.008)
    room.box(at, (0, front - 0.032, 0.24), (width_m - 0.16, 0.024, 0.3), "black", 0.01)
    room.rod(at, (-width_m / 2 + 0.07, front, 0.64), (width_m / 2 - 0.07, front, 0.64), 0.01, "chrome")
    for number in range(4):
        room.cylinder(at, (-0.2 + number * 0.133, front - 0.05, 0.78), 0.022, 0.035, "black", LYING)
    pot(room, at.moved(-0.14, -0.14), 0.91)
    room.block(at, (0, 0, WORKTOP_M / 2), (width_m, DEPTH_M, WORKTOP_M))


def pot(room: Room, at: Frame, z_m: float) -> None:
    """A cooking pot with a lid."""
    side = [(0, 0), (0.1, 0), (0.105, 0.01), (0.105, 0.13), (0.112, 0.135), (0.06, 0.155), (0, 0.16)]
    room.turned(at, (0, 0, z_m), side, "chrome", slices=24)
    room.ball(at, (0, 0, z_m + 0.17), (0.016, 0.016, 0.014), "black", slices=8)
    for side_x in (-1, 1):
        room.rod(at, (side_x * 0.1, 0, z_m + 0.1), (side_x * 0.145, 0, z_m + 0.1), 0.009, "black")


def hood(room: Room, at: Frame, width_m: float = 0.66) -> None:
    """An extractor hood on a wall frame, up to the ceiling."""
    room.box(at, (0, 0.24, 1.58), (width_m, 0.48, 0.06), "steel", 0.006)
    for number, (wide, deep) in enumerate(((0.56, 0.42), (0.44, 0.36), (0.34, 0.3))):
        room.box(at, (0, deep / 2, 1.64 + 0.04 * number), (wide, deep, 0.042), "steel", 0.006)
    room.box(at, (0, 0.13, 1.75), (0.27, 0.26, room.height_m - 1.75), "steel", 0.004)


def sink(room: Room, at: Frame, depth_m: float = DEPTH_M) -> None:
    """A steel sink with a tap, set in a worktop; at the middle of the counter's footprint."""
    spare_m = min(0.0, depth_m - 0.48)  # that it must be less deep
    room.box(at, (0, 0.02, WORKTOP_M - 0.006), (0.62, 0.42 + spare_m, 0.012), "chrome", 0.005)
    room.box(at, (-0.13, 0.02, WORKTOP_M - 0.002), (0.3, 0.34 + spare_m, 0.009), "rubber", 0.003)
    room.box(at, (-0.13, 0.02, WORKTOP_M), (0.27, 0.31 + spare_m, 0.009), "steel", 0.003)
    for number in range(5):
        room.box(at, (0.1 + 0.04 * number, 0.02, WORKTOP_M + 0.004), (0.012, 0.3 + spare_m, 0.006), "chrome", 0.002)
    tap(room, at.moved(-0.13, -0.2 - spare_m / 2), WORKTOP_M)


def tap(room: Room, at: Frame, z_m: float, height_m: float = 0.26, reach_m: float = 0.17) -> None:
    """A swan-neck tap that reaches towards +y."""
    bend = 0.05
    room.cylinder(at, (0, 0, z_m), 0.024, 0.02, "chrome")
    room.rod(at, (0, 0, z_m), (0, 0, z_m + height_m - bend), 0.013, "chrome")
    room.rod(at, (0, 0, z_m + height_m - bend - 0.004), (0, bend, z_m + height_m), 0.012, "chrome")
    room.rod(at, (0, bend - 0.004, z_m + height_m), (0, reach_m, z_m + height_m), 0.012, "chrome")
    room.rod(at, (0, reach_m, z_m + height_m + 0.008), (0, reach_m, z_m + height_m - 0.05), 0.012, "chrome")
    room.rod(at, (0.02, 0, z_m + 0.05), (0.075, 0, z_m + 0.07), 0.007, "chrome")


def island(room: Room, at: Frame, length_m: float, depth_m: float, top: str = "marble") -> None:
    """A free-standing block with doors at +y and panels at its other sides; the worktop overhangs at -y."""
    body = depth_m - 0.26
    shift = 0.11
    room.box(at, (0, shift, 0.09), (length_m - 0.06, body, WORKTOP_M - 0.13), "cabinet", 0.004)
    room.box(at, (0, shift, 0), (length_m - 0.14, body - 0.08, 0.1), "rubber", segments=0)
    room.box(at, (0, 0, WORKTOP_M - 0.045), (length_m, depth_m, 0.045), top, 0.01)
    _fronts(room, at.moved(0, shift), length_m - 0.08, body / 2 + 0.008, True, "cabinet")
    count = max(2, round(length_m / 0.6))
    wide = (length_m - 0.08) / count
    for number in range(count):
        x = -length_m / 2 + 0.04 + wide * (number + 0.5)
        room.box(at, (x, shift - body / 2 - 0.006, 0.15), (wide - 0.06, 0.02, 0.65), "cabinet", 0.008)
    for side in (-1, 1):
        room.box(at, (side * (length_m / 2 - 0.026), shift, 0.15), (0.02, body - 0.08, 0.65), "cabinet", 0.008)
    room.block(at, (0, 0, WORKTOP_M / 2), (length_m, depth_m, WORKTOP_M))


def kettle(room: Room, at: Frame, z_m: float = WORKTOP_M) -> None:
    """A kettle."""
    body = [(0, 0), (0.085, 0), (0.085, 0.02), (0.07, 0.15), (0.05, 0.2), (0, 0.21)]
    room.turned(at, (0, 0, z_m), body, "steel", slices=20)
    room.ball(at, (0, 0, z_m + 0.215), (0.014, 0.014, 0.014), "black", slices=8)
    room.box(at, (0.11, 0, z_m + 0.04), (0.02, 0.03, 0.14), "black", 0.009)
    room.rod(at, (-0.06, 0, z_m + 0.12), (-0.12, 0, z_m + 0.17), 0.014, "steel")


def toaster(room: Room, at: Frame, z_m: float = WORKTOP_M) -> None:
    """A toaster."""
    room.box(at, (0, 0, z_m + 0.01), (0.28, 0.17, 0.18), "red", 0.04, segments=2)
    for y in (-0.035, 0.035):
        room.box(at, (0, y, z_m + 0.186), (0.2, 0.025, 0.006), "rubber", 0.002)
    room.box(at, (0.145, 0, z_m + 0.1), (0.02, 0.04, 0.02), "black", 0.006)


def microwave(room: Room, at: Frame, z_m: float = WORKTOP_M) -> None:
    """A microwave oven."""
    room.box(at, (0, 0, z_m + 0.01), (0.48, 0.34, 0.28), "steel", 0.01)
    room.box(at, (-0.06, 0.17, z_m + 0.03), (0.33, 0.012, 0.24), "black", 0.006)
    room.box(at, (0.18, 0.17, z_m + 0.03), (0.1, 0.012, 0.24), "rubber", 0.004)
    room.rod(at, (0.115, 0.195, z_m + 0.06), (0.115, 0.195, z_m + 0.24), 0.008, "chrome")


def knife_block(room: Room, at: Frame, z_m: float = WORKTOP_M) -> None:
    """Knives in a wooden block, with a chopping board behind."""
    room.box(at, (0.16, -0.02, z_m), (0.11, 0.16, 0.2), "walnut", 0.01, turn("x", -12))
    for number in range(3):
        room.box(at, (0.13 + 0.03 * number, -0.01, z_m + 0.19), (0.016, 0.024, 0.09), "black", 0.005, turn("x", -12))
    room.box(at, (-0.1, -0.12, z_m), (0.3, 0.02, 0.38), "oak", 0.008, turn("x", -8))


def jars(room: Room, at: Frame, z_m: float = WORKTOP_M) -> None:
    """Three storage jars."""
    for number, material in enumerate(("cream", "second accent", "porcelain")):
        high = 0.2 - 0.035 * number
        side = [(0, 0), (0.055, 0), (0.06, 0.02), (0.06, high), (0.05, high + 0.01)]
        room.turned(at, (0.14 * (number - 1), 0, z_m), side, material, slices=18)
        room.cylinder(at, (0.14 * (number - 1), 0, z_m + high + 0.008), 0.055, 0.02, "wood")
