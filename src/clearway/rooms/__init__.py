"""Furnished rooms built with MuJoCo: shapes, textures, baked light, and the grid that an agent walks on.

`build_room` makes one of the four default rooms; nothing here imports MuJoCo before a room is built.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from clearway.choices import RoomName
from clearway.errors import SceneError

if TYPE_CHECKING:
    from clearway.rooms.detail import Detail
    from clearway.rooms.room import Room

ROOM_NAMES: tuple[RoomName, ...] = ("bathroom", "bedroom", "living_room", "kitchen")


def build_room(
    name: str, seed: int = 0, *, looks: bool = True, loose: bool = False, detail: Detail | None = None
) -> Room:
    """A furnished room.

    Args:
        name: one of ROOM_NAMES.
        seed: 0 is the default room; another seed gives other colours, pictures and small furniture.
        looks: bake the light, so that `room.spec.compile()` is ready to render (some seconds); False gives the
            obstacles and the grid only, in milliseconds.
        loose: every piece of furniture hangs on a body of its own, so that it can be moved (`pieces`).
        detail: how finely it is modelled and lit; None: `detail.FULL`. `detail.SMALL` is for small pictures.

    Raises:
        SceneError: there is no room of that name, or the seed is negative.
    """
    if name not in ROOM_NAMES:
        raise SceneError(name, "there is no room of this name", f"Choose one of {', '.join(ROOM_NAMES)}.")
    if seed < 0:
        raise SceneError(name, f"the seed must be 0 or more, found {seed}", "Choose another seed.")
    from clearway.rooms.detail import FULL

    room = import_module(f"{__name__}.{name}").build(seed, looks, detail or FULL)
    if looks:
        from clearway.rooms.light import bake

        bake(room, loose=loose)
    return room
