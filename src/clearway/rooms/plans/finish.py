"""Floors and walls for the rooms of floor plans; the room's generator chooses."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from clearway.rooms import finishes, textures
from clearway.rooms.finishes import WHITE
from clearway.rooms.materials import varied
from clearway.rooms.plans.layout import Layout
from clearway.rooms.room import Room
from clearway.rooms.shell import SIDES, Finish
from clearway.rooms.surfaces import pixels

RUG_M = (2.2, 1.6)


def finish_of(room: Room, layout: Layout) -> Finish:
    """A floor with a rug where most of it is free, four walls, and paper for the walls inside."""
    walls = {side: finishes.aged(room, _wall(room, side)) for side in SIDES}
    longest = "south" if room.width_m >= room.depth_m else "west"
    floor = finishes.with_rug(room, _floor(room), _roomiest_m(layout), RUG_M)
    return Finish(floor, finishes.plain_ceiling(room), walls, finishes.aged(room, _wall(room, longest)))


def _pattern(room: Room) -> str:
    return textures.WALLPAPERS[int(room.rng.integers(len(textures.WALLPAPERS)))]


def _floor(room: Room) -> np.ndarray:
    """Planks, parquet, tiles or carpet."""
    kind = int(room.rng.integers(4))
    if kind == 0:
        return finishes.plank_floor(room)
    if kind == 1:
        return finishes.parquet_floor(room)
    if kind == 2:
        tile, grout = varied(room.rng, (0.72, 0.62, 0.5)), (0.52, 0.47, 0.4)
        return finishes.floor_of(room, textures.tiles(room.rng, pixels(4), pixels(4), 8, 8, tile, grout, 0.1, 0.25))
    pile = varied(room.rng, (0.62, 0.57, 0.5), 0.05)
    return finishes.floor_of(room, textures.pile(room.rng, pixels(3), pixels(3), pile, (0.52, 0.47, 0.41)))


def _wall(room: Room, side: str) -> np.ndarray:
    """Paper or paint, over boards or down to the floor."""
    colours = room.colours
    if room.rng.random() < 0.7:
        above = finishes.papered_wall(room, side, varied(room.rng, colours.wall), _pattern(room), 0.3)
    else:
        above = finishes.painted_wall(room, side, varied(room.rng, colours.feature_wall))
    if room.rng.random() < 0.5:
        return above
    return finishes.boarded_wall(room, side, above, WHITE if room.rng.random() < 0.5 else colours.cabinet)


def _roomiest_m(layout: Layout) -> tuple[float, float]:
    """The middle of the free cells' part that is farthest from anything blocked, in room coordinates."""
    room_to_spare = ndimage.distance_transform_cdt(np.pad(layout.free, 1), "chessboard")[1:-1, 1:-1]
    x_m, y_m = layout.middles_m(np.argwhere(room_to_spare == room_to_spare.max())).mean(axis=0)
    return float(x_m), float(y_m)
