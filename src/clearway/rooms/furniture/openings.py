"""Windows and doors; frames come from `Room.wall`."""

from __future__ import annotations

import numpy as np

from clearway.rooms import artwork
from clearway.rooms.frame import Frame
from clearway.rooms.groups import CEILING_GROUP, SHELL_NAME
from clearway.rooms.parts import Window
from clearway.rooms.room import Room

FRAME_M = 0.06
CURTAIN_REACH_M = 0.38  # of a curtain's rail beyond the window
ARCHITRAVE_M = (0.075, 0.02)  # broad, thick
REVEAL_M = 0.008  # of a doorway's lining that its architrave leaves open


def window(room: Room, at: Frame, width_m: float, height_m: float, curtains: bool = True, panes: int = 2) -> None:
    """A window with a view and a sill; `at` is the middle of its lower edge on the wall."""
    centre = room.place(at, (0, 0, height_m / 2))
    inward = room.direction(at, 0, 1, 0)
    room.windows.append(Window(centre, inward, width_m, height_m))
    room.picture(
        at,
        (0, 0.012, height_m / 2),
        (width_m, height_m),
        lambda rng, step: artwork.outdoor(rng, 256, round(256 * width_m / height_m), step),
        emission=0.95,
        specular=0.0,
    )
    for x in np.linspace(-width_m / 2, width_m / 2, panes + 1):
        thick = FRAME_M if abs(x) > width_m / 2 - 0.01 else 0.04
        room.box(at, (x, 0.025, -FRAME_M / 2), (thick, 0.05, height_m + FRAME_M), "trim", 0.006)
    for z in (-FRAME_M / 2, height_m - FRAME_M / 2):
        room.box(at, (0, 0.025, z), (width_m + FRAME_M, 0.052, FRAME_M), "trim", 0.006)
    room.box(at, (0, 0.08, -FRAME_M / 2 - 0.03), (width_m + 0.2, 0.16, 0.03), "trim", 0.008)
    if curtains:
        _curtains(room, at, width_m, height_m)


def _curtains(room: Room, at: Frame, width_m: float, height_m: float) -> None:
    """A rail with rings' worth of cloth drawn to both sides, down to the floor or, high up, below the sill."""
    top = height_m + 0.16
    bottom = -at.z_m + 0.03 if at.z_m < 1.15 else -0.12
    half = width_m / 2 + CURTAIN_REACH_M
    room.rod(at, (-half, 0.11, top), (half, 0.11, top), 0.013, "walnut")
    for side in (-1, 1):
        room.ball(at, (side * half, 0.11, top), (0.028, 0.028, 0.028), "walnut", slices=8)
        room.cloth(at, (side * (half - 0.24), 0.11, bottom), (0.42, top - bottom - 0.015), 5, "curtain")


def door(room: Room, at: Frame, material: str = "wood", width_m: float = 0.85, panels: int = 2) -> None:
    """A closed panelled door with its architrave."""
    height = 2.05
    room.box(at, (0, 0.012, 0), (width_m, 0.024, height), material, 0.004)
    span = (height - 0.3) / panels
    for row in range(panels):
        for column in (-1, 1):
            room.box(
                at,
                (column * width_m / 4 * 0.92, 0.024, 0.16 + row * span),
                (width_m / 2 - 0.15, 0.014, span - 0.12),
                material,
                0.012,
            )
    for side in (-1, 1):
        room.box(at, (side * (width_m / 2 + 0.04), 0.02, 0), (0.08, 0.044, height + 0.08), "trim", 0.008)
    room.box(at, (0, 0.02, height), (width_m, 0.042, 0.08), "trim", 0.008)
    room.cylinder(at, (width_m / 2 - 0.07, 0.026, 0.99), 0.026, 0.012, "brass", (np.sqrt(0.5), -np.sqrt(0.5), 0, 0))
    room.rod(at, (width_m / 2 - 0.07, 0.055, 0.99), (width_m / 2 - 0.18, 0.055, 0.99), 0.009, "brass")
    room.rod(at, (width_m / 2 - 0.07, 0.024, 0.99), (width_m / 2 - 0.07, 0.06, 0.99), 0.008, "brass")


def doorway(room: Room, at: Frame, width_m: float, depth_m: float, height_m: float, lining_m: float) -> None:
    """An open doorway in a wall: jambs, a head, an architrave on both sides, and what stops light and bodies above.

    What hides the way from above is in the group of the ceiling.

    Args:
        room: where to.
        at: the middle of its floor; one walks through along y.
        width_m: between the walls at its sides.
        depth_m: thickness of the wall.
        height_m: of the opening.
        lining_m: thickness of jambs and head, within the width.
    """
    lintel_m = room.height_m - height_m
    room.block(at, (0, 0, height_m + lintel_m / 2), (width_m, depth_m, lintel_m), f"{SHELL_NAME} {_title(at)} lintel")
    for side in (-1, 1):
        middle_m = side * (width_m - lining_m) / 2
        room.block(
            at, (middle_m, 0, height_m / 2), (lining_m, depth_m, height_m), f"{SHELL_NAME} {_title(at)} jamb {side}"
        )
    if not room.looks:
        return
    room.shadow_box(at.moved(0, 0, height_m + lining_m), (width_m, depth_m, lintel_m - lining_m))
    proud_m = depth_m + 0.01
    for side in (-1, 1):
        room.box(at, (side * (width_m - lining_m) / 2, 0, 0), (lining_m, proud_m, height_m + lining_m), "trim", 0.004)
    room.box(at, (0, 0, height_m), (width_m - 2 * lining_m, proud_m, lining_m), "trim", 0.004, group=CEILING_GROUP)
    broad_m, thick_m = ARCHITRAVE_M
    inner_m = width_m / 2 - lining_m + REVEAL_M
    for front in (at.moved(0, depth_m / 2), at.moved(0, -depth_m / 2, 0, 180.0)):
        for side in (-1, 1):
            place = (side * (inner_m + broad_m / 2), thick_m / 2, 0)
            room.box(front, place, (broad_m, thick_m, height_m + REVEAL_M), "trim", 0.006)
        size = (2 * (inner_m + broad_m), thick_m, broad_m)
        room.box(front, (0, thick_m / 2, height_m + REVEAL_M), size, "trim", 0.006, group=CEILING_GROUP)


def _title(at: Frame) -> str:
    """A name that no other doorway has."""
    return f"door {at.x_m:.3f} {at.y_m:.3f}"
