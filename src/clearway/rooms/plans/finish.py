"""Floors and walls for the rooms of floor plans; the room's generator chooses."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy import ndimage

from clearway.rooms import finishes, textures
from clearway.rooms.finishes import WHITE
from clearway.rooms.materials import varied
from clearway.rooms.plans.layout import Layout
from clearway.rooms.plans.walls import GAP
from clearway.rooms.room import Room
from clearway.rooms.shell import SIDES, Face, Finish, wall_size_m
from clearway.rooms.surfaces import PIXELS_PER_METRE, pixels

RUG_M = (2.2, 1.6)
WET = {"bathroom": 0.2, "kitchen": 0.15}  # uses with tiled walls, and the height of a tile there, metres


def finish_of(room: Room, layout: Layout) -> Finish:
    """A floor with a rug where most of it is free, four walls, and paper for the walls inside.

    Areas of a plan have floors and papers of their own.
    """
    longest = "south" if room.width_m >= room.depth_m else "west"
    if (layout.area_map >= 0).any():
        floor, ceiling = _floor_by_area(room, layout), finishes.plain_ceiling(room)
        papers = [finishes.aged(room, longest, _paper(room, longest, area.use)) for area in layout.areas]
        walls = {side: _papered_by_area(room, side, papers, layout) for side in SIDES}
        return Finish(floor, ceiling, walls, papers[0], [papers[_area_before(face, layout)] for face in layout.faces])
    walls = {side: finishes.aged(room, side, _wall(room, side)) for side in SIDES}
    floor = _with_rug(room, _floor(room), _roomiest_m(layout), layout)
    ceiling, inner = finishes.plain_ceiling(room), finishes.aged(room, longest, _wall(room, longest))
    return Finish(floor, ceiling, walls, inner, [inner] * len(layout.faces))


def _paper(room: Room, side: str, use: str) -> np.ndarray:
    """Tiles in bathrooms and kitchens, paper or paint elsewhere."""
    if use not in WET:
        return _wall(room, side)
    paint = finishes.painted_wall(room, side, varied(room.rng, room.colours.wall))
    tile = varied(room.rng, (0.84, 0.86, 0.85), 0.06)
    height_m = 2.05 if use == "bathroom" else 1.45
    return finishes.tiled_wall(room, side, paint, tile, height_m, room.colours.accent, WET[use])


def _papered_by_area(room: Room, side: str, papers: Sequence[np.ndarray], layout: Layout) -> np.ndarray:
    """An outer wall with the paper of every area that lies before it."""
    areas = layout.area_map
    numbers = {"south": areas[:, 0], "north": areas[:, -1], "west": areas[0], "east": areas[-1]}[side]
    if side in ("south", "east"):  # their pictures run to lower coordinates
        numbers = numbers[::-1]
    rows, columns = (pixels(length_m, room.detail.texture_step) for length_m in wall_size_m(room, side)[::-1])
    covered = np.empty((rows, columns, 3))
    marks = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(numbers)]
    for start, end in pairwise(marks):
        first, last = (round(columns * mark / len(numbers)) for mark in (start, end))
        covered[:, first:last] = papers[numbers[start]][:rows, first:last]
    return covered


def _area_before(face: Face, layout: Layout) -> int:
    """The number of the area that a face looks at."""
    x_m, y_m, _ = face.at.point(0, 1.5 * GAP * layout.cell_size_m, 0)
    return int(layout.area_at(x_m, y_m))


def _floor_by_area(room: Room, layout: Layout) -> np.ndarray:
    """Tiles in bathrooms and kitchens, one floor in all other areas, a rug in the roomiest living room or bedroom."""
    floor, step = _floor(room), room.detail.texture_step
    rugs = [number for number, area in enumerate(layout.areas) if area.use in ("living room", "bedroom")]
    x_m, y_m = layout.middles_m(np.indices(layout.free.shape).transpose(1, 2, 0)).transpose(2, 0, 1)
    roomy = layout.free & np.isin(layout.area_at(x_m, y_m), rugs)
    if roomy.any():
        floor = _with_rug(room, floor, _roomiest_m(layout, roomy), layout)
    y_m, x_m = ((np.arange(count) + 0.5) * step / PIXELS_PER_METRE for count in floor.shape[:2])
    numbers = layout.area_at(x_m[None], y_m[:, None])
    for use in sorted(WET):
        here = np.isin(numbers, [number for number, area in enumerate(layout.areas) if area.use == use])
        if not here.any():
            continue
        colour, second = varied(room.rng, (0.8, 0.78, 0.74)), None if room.rng.random() < 0.5 else (0.36, 0.38, 0.4)
        tiles = textures.tiles(
            room.rng, pixels(4), pixels(4), 12, 12, colour, (0.55, 0.54, 0.5), 0.08, 0.15, second=second, step=step
        )
        floor[here] = finishes.floor_of(room, tiles)[here]
    return floor


def _with_rug(room: Room, floor: np.ndarray, middle_m: tuple[float, float], layout: Layout) -> np.ndarray:
    """The floor with a rug, smaller or none where walls inside leave no room for it."""
    for share in (1.0, 0.85, 0.7, 0.55) if layout.has_walls else ():
        if _is_clear(middle_m, (share * RUG_M[0], share * RUG_M[1]), layout):
            return finishes.with_rug(room, floor, middle_m, (share * RUG_M[0], share * RUG_M[1]))
    return floor if layout.has_walls else finishes.with_rug(room, floor, middle_m, RUG_M)


def _is_clear(middle_m: tuple[float, float], size_m: tuple[float, float], layout: Layout) -> bool:
    """Whether a rectangle of floor lies within the room and under no wall."""
    low, high = (
        tuple(place + sign * side / 2 for place, side in zip(middle_m, size_m, strict=True)) for sign in (-1, 1)
    )
    inside = min(low) > 0 and high[0] < layout.width_m and high[1] < layout.depth_m
    return inside and not any(
        low[0] < wall.x_max_m and high[0] > wall.x_min_m and low[1] < wall.y_max_m and high[1] > wall.y_min_m
        for wall in layout.walls
    )


def _pattern(room: Room) -> str:
    return textures.WALLPAPERS[int(room.rng.integers(len(textures.WALLPAPERS)))]


def _floor(room: Room) -> np.ndarray:
    """Planks, parquet, tiles or carpet."""
    kind, step = int(room.rng.integers(4)), room.detail.texture_step
    if kind == 0:
        return finishes.plank_floor(room)
    if kind == 1:
        return finishes.parquet_floor(room)
    if kind == 2:
        tile, grout = varied(room.rng, (0.72, 0.62, 0.5)), (0.52, 0.47, 0.4)
        image = textures.tiles(room.rng, pixels(4), pixels(4), 8, 8, tile, grout, 0.1, 0.25, step=step)
        return finishes.floor_of(room, image)
    pile = varied(room.rng, (0.62, 0.57, 0.5), 0.05)
    return finishes.floor_of(room, textures.pile(room.rng, pixels(3), pixels(3), pile, (0.52, 0.47, 0.41), step))


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


def _roomiest_m(layout: Layout, free: np.ndarray | None = None) -> tuple[float, float]:
    """The middle of the free cells' part that is farthest from anything blocked, in room coordinates."""
    free = layout.free if free is None else free
    room_to_spare = ndimage.distance_transform_cdt(np.pad(free, 1), "chessboard")[1:-1, 1:-1]
    if layout.has_walls:  # the mean of several such places may lie in a wall
        roomiest = room_to_spare == room_to_spare.max()
        one_room = layout.rooms == layout.rooms[roomiest][0]
        places_m = layout.middles_m(np.argwhere(roomiest & one_room))
        x_m, y_m = places_m[np.linalg.norm(places_m - places_m.mean(axis=0), axis=1).argmin()]
        return float(x_m), float(y_m)
    x_m, y_m = layout.middles_m(np.argwhere(room_to_spare == room_to_spare.max())).mean(axis=0)
    return float(x_m), float(y_m)
