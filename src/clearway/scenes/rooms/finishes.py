"""Ready floors and walls for the default rooms, painted at the scale of the surfaces."""

from __future__ import annotations

import numpy as np

from clearway.scenes.rooms import pictures, textures
from clearway.scenes.rooms.materials import varied
from clearway.scenes.rooms.room import Room
from clearway.scenes.rooms.shell import SIDES, wall_size_m
from clearway.scenes.rooms.surfaces import pasted, pixels, tiled
from clearway.scenes.rooms.textures import Colour

WHITE: Colour = (0.9, 0.9, 0.88)


def floor_of(room: Room, image: np.ndarray) -> np.ndarray:
    """A floor covered with a tileable texture."""
    return tiled(image, room.width_m, room.depth_m)


def plank_floor(room: Room) -> np.ndarray:
    """Planks about 14 cm wide in the scheme's wood, no two alike."""
    side = 6.0
    image = textures.planks(
        room.rng, pixels(side), pixels(side), round(side / 0.14), room.colours.dark_wood, room.colours.light_wood
    )
    return floor_of(room, image)


def parquet_floor(room: Room) -> np.ndarray:
    """Square parquet in the scheme's wood."""
    image = textures.parquet(room.rng, pixels(4), pixels(4), 10, room.colours.dark_wood, room.colours.light_wood)
    return floor_of(room, image)


def plain_ceiling(room: Room) -> np.ndarray:
    """A white ceiling."""
    return tiled(textures.plaster(room.rng, pixels(2), pixels(2), WHITE, 0.03), room.width_m, room.depth_m)


def painted_wall(room: Room, side: str, colour: Colour) -> np.ndarray:
    """A wall in one colour."""
    image = textures.plaster(room.rng, pixels(4), pixels(4), colour, 0.06)
    return tiled(image, *wall_size_m(room, side))


def papered_wall(room: Room, side: str, colour: Colour, pattern: str, repeat_m: float = 0.25) -> np.ndarray:
    """A wall with paper in two close tones."""
    darker = (colour[0] * 0.92, colour[1] * 0.92, colour[2] * 0.91)
    image = textures.wallpaper(room.rng, pixels(2), pixels(2), colour, darker, pattern, round(2 / repeat_m))
    return tiled(image, *wall_size_m(room, side))


def wainscot(room: Room, side: str, colour: Colour) -> np.ndarray:
    """Painted boarding, to be used for the lower part of a wall."""
    image = textures.plaster(room.rng, pixels(2), pixels(2), colour, 0.03)
    x = np.arange(pixels(2)) / pixels(2) * 2
    groove = np.abs((x / 0.125) % 1 - 0.5) > 0.44
    image[:, groove] *= 0.86
    return tiled(image, *wall_size_m(room, side))


def sides_of(room: Room, make: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The four walls, checked to be complete."""
    assert set(make) == set(SIDES), make.keys()
    return make


def with_rug(
    room: Room, floor: np.ndarray, centre_m: tuple[float, float], size_m: tuple[float, float], pattern: str = "",
    round_edge: bool = False,
) -> np.ndarray:  # fmt: skip
    """A floor with a rug in the scheme's colours; without a name the seed chooses the pattern."""
    chosen = pattern or pictures.RUGS[int(room.rng.integers(len(pictures.RUGS)))]
    ground, second = varied(room.rng, room.colours.rug, 0.04), varied(room.rng, room.colours.rug_second, 0.04)
    image = pictures.rug(room.rng, pixels(size_m[1]), pixels(size_m[0]), ground, second, chosen)
    return pasted(floor, image, centre_m, round_edge)
