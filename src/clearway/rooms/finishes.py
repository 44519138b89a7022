"""Ready floors and walls, painted at the scale of the surfaces and in the detail of the room."""

from __future__ import annotations

import numpy as np

from clearway.rooms import artwork, textures
from clearway.rooms.materials import varied
from clearway.rooms.room import Room
from clearway.rooms.shell import wall_size_m
from clearway.rooms.surfaces import pasted, pixels, tiled, with_band
from clearway.rooms.textures import Colour

WHITE: Colour = (0.9, 0.9, 0.88)


def floor_of(room: Room, image: np.ndarray) -> np.ndarray:
    """A floor covered with a tileable texture."""
    return tiled(image, room.width_m, room.depth_m, room.detail.texture_step)


def plank_floor(room: Room) -> np.ndarray:
    """Planks about 14 cm wide in the scheme's wood, no two alike."""
    side = 6.0
    colours, step = room.colours, room.detail.texture_step
    image = textures.planks(
        room.rng, pixels(side), pixels(side), round(side / 0.14), colours.dark_wood, colours.light_wood, step
    )
    return floor_of(room, image)


def parquet_floor(room: Room) -> np.ndarray:
    """Square parquet in the scheme's wood."""
    colours, step = room.colours, room.detail.texture_step
    image = textures.parquet(room.rng, pixels(4), pixels(4), 10, colours.dark_wood, colours.light_wood, step)
    return floor_of(room, image)


def plain_ceiling(room: Room) -> np.ndarray:
    """A white ceiling."""
    return floor_of(room, textures.plaster(room.rng, pixels(2), pixels(2), WHITE, 0.03, room.detail.texture_step))


def painted_wall(room: Room, side: str, colour: Colour) -> np.ndarray:
    """A wall in one colour."""
    step = room.detail.texture_step
    image = textures.plaster(room.rng, pixels(4), pixels(4), colour, 0.1, step)
    return tiled(image, *wall_size_m(room, side), step)


def papered_wall(room: Room, side: str, colour: Colour, pattern: str, repeat_m: float = 0.22) -> np.ndarray:
    """A wall with paper in two close tones."""
    darker = (colour[0] * 0.86, colour[1] * 0.85, colour[2] * 0.84)
    step = room.detail.texture_step
    image = textures.wallpaper(room.rng, pixels(2), pixels(2), colour, darker, pattern, round(2 / repeat_m), step)
    return tiled(image, *wall_size_m(room, side), step)


def boarded_wall(room: Room, side: str, above: np.ndarray, colour: Colour, height_m: float = 0.95) -> np.ndarray:
    """A wall with upright painted boards below a rail."""
    step = room.detail.texture_step
    image = textures.plaster(room.rng, pixels(2), pixels(2), colour, 0.04, step)
    board = np.arange(pixels(2)) / pixels(2) * 15  # 13 cm wide: not in step with the grid's 50 cm
    shade = np.where(np.abs(board % 1 - 0.5) > 0.45, 0.8, 1.0)
    image *= textures.stepped_mean(shade, step)[:, None]
    return with_band(tiled(image, *wall_size_m(room, side), step), above, height_m, np.array(colour), step)


def tiled_wall(
    room: Room, side: str, above: np.ndarray, colour: Colour, height_m: float, rail: Colour, tile_m: float = 0.3
) -> np.ndarray:
    """A wall with bonded tiles, twice as wide as high, below a rail."""
    columns, step = round(2.4 / tile_m), room.detail.texture_step
    tiles = textures.tiles(
        room.rng,
        pixels(2.4),
        pixels(2.4),
        columns,
        2 * columns,
        colour,
        (colour[0] * 0.78, colour[1] * 0.78, colour[2] * 0.78),
        0.07,
        0.08,
        2,
        bonded=True,
        step=step,
    )
    return with_band(tiled(tiles, *wall_size_m(room, side), step), above, height_m, np.array(rail), step)


def with_rug(
    room: Room,
    floor: np.ndarray,
    centre_m: tuple[float, float],
    size_m: tuple[float, float],
    pattern: str = "",
    round_edge: bool = False,
) -> np.ndarray:
    """A floor with a rug in the scheme's colours; without a name the seed chooses the pattern."""
    chosen = pattern or artwork.RUGS[int(room.rng.integers(len(artwork.RUGS)))]
    ground, second = varied(room.rng, room.colours.rug, 0.04), varied(room.rng, room.colours.rug_second, 0.04)
    step = room.detail.texture_step
    image = artwork.rug(room.rng, pixels(size_m[1]), pixels(size_m[0]), ground, second, chosen, step)
    return pasted(floor, image, centre_m, round_edge, step)


def aged(room: Room, side: str, wall: np.ndarray) -> np.ndarray:
    """A wall with faint stains that nowhere repeat, so that no two places look alike."""
    columns, rows = (pixels(length_m) for length_m in wall_size_m(room, side))
    stretch, step = columns / rows, room.detail.texture_step
    stains = textures.noise(room.rng, rows, columns, 1.3, stretch_y=stretch, step=step)[..., None] - 0.5
    return np.clip(wall * (1 + 0.22 * stains), 0, 1)
