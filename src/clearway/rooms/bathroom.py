"""The bathroom: 5.0 x 4.0 m, 45 cells around a wall between the basin and the tub."""

from __future__ import annotations

import numpy as np

from clearway.rooms import finishes, textures
from clearway.rooms.detail import FULL, Detail
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import bathroom as fittings
from clearway.rooms.furniture import decor, lamps, openings, storage
from clearway.rooms.furniture.small import any_small_piece
from clearway.rooms.materials import varied
from clearway.rooms.room import Room
from clearway.rooms.shell import SIDES, Column, Finish, add_surfaces, add_walls
from clearway.rooms.surfaces import pixels
from clearway.rooms.textures import Colour

WIDTH_M, DEPTH_M, HEIGHT_M = 5.0, 4.0, 2.5
WALL = Column(0.0, 1.69, 3.4, 1.81)
COLUMNS = (WALL,)


def build(seed: int, looks: bool, detail: Detail = FULL) -> Room:
    """The bathroom without its light."""
    room = Room(
        "bathroom", WIDTH_M, DEPTH_M, HEIGHT_M, (0.25, 0.25), seed, looks, mirrored=seed % 2 == 1, detail=detail
    )
    add_walls(room, COLUMNS)
    if looks:
        add_surfaces(room, _finish(room), COLUMNS)
    _place_fittings(room)
    _place_ornaments(room)
    return room


def _finish(room: Room) -> Finish:
    """A chessboard or slate floor; tiles up to a band and paint above, differently high on each wall."""
    floor = textures.tiles(room.rng, pixels(4), pixels(4), 10, 10, (0.36, 0.37, 0.38), (0.6, 0.59, 0.56), 0.14, 0.3)
    if room.rng.random() < 0.5:
        floor = textures.tiles(
            room.rng,
            pixels(4),
            pixels(4),
            12,
            12,
            (0.84, 0.83, 0.8),
            (0.55, 0.54, 0.52),
            0.05,
            0.15,
            second=(0.3, 0.33, 0.36),
        )
    covered = finishes.with_rug(room, finishes.floor_of(room, floor), (0.95, 2.7), (1.1, 0.6), "stripes")
    walls = {side: finishes.aged(room, side, _wall(room, side)) for side in SIDES}
    paint = finishes.painted_wall(room, "south", room.colours.wall)
    partition = finishes.tiled_wall(
        room, "south", paint, varied(room.rng, (0.8, 0.82, 0.8), 0.02), 1.45, _rail(room), 0.15
    )
    return Finish(covered, finishes.plain_ceiling(room), walls, finishes.aged(room, "south", partition), skirting=None)


def _wall(room: Room, side: str) -> np.ndarray:
    """Tiles and paint; size, colour and height of the tiles differ by wall."""
    colours = room.colours
    paint = finishes.painted_wall(room, side, colours.feature_wall if side == "west" else colours.wall)
    red, green, blue = colours.feature_wall
    pale = (0.55 + 0.4 * red, 0.55 + 0.4 * green, 0.55 + 0.4 * blue)
    tile, height, size = {
        "north": (pale, 2.1, 0.2),
        "east": ((0.88, 0.89, 0.88), 1.2, 0.3),
        "south": ((0.88, 0.89, 0.88), 1.2, 0.3),
        "west": (pale, 1.0, 0.24),
    }[side]
    return finishes.tiled_wall(room, side, paint, tile, height, _rail(room), size)


def _rail(room: Room) -> Colour:
    """The colour of the row that ends the tiles."""
    red, green, blue = room.colours.accent
    return 0.8 * red, 0.8 * green, 0.8 * blue


def _place_fittings(room: Room) -> None:
    """Everything an agent can bump into."""
    fittings.bathtub(room, Frame(0.87, DEPTH_M - 0.39, 180.0), 1.7, 0.75)
    fittings.shower(room, Frame(WIDTH_M - 0.49, DEPTH_M - 0.49, 180.0))
    storage.wardrobe(room, room.wall("north", 2.86, gap_m=0.31), 1.0, 1.85, 0.6)
    fittings.vanity(room, room.wall("south", 2.15, gap_m=0.245), 1.3)
    fittings.toilet(room, room.wall("south", 3.75, gap_m=0.36))
    fittings.washing_machine(room, room.wall("south", 4.65, gap_m=0.32))
    any_small_piece(room, Frame(3.75, DEPTH_M - 0.27))


def _place_ornaments(room: Room) -> None:
    """Door, window, lamps and what hangs on the walls."""
    openings.door(room, room.wall("west", 0.85), "white")
    openings.window(room, room.wall("east", 2.0, 1.25), 1.0, 0.85, curtains=False)
    decor.mirror(room, room.wall("south", 2.15, 1.5), 1.1, 0.9)
    for x in (1.4, 2.9):
        lamps.wall_lamp(room, room.wall("south", x, 1.55))
    fittings.paper_holder(room, Frame(3.35, 0.0, 0.0, 0.75))
    south_face, north_face = Frame(0, WALL.y_min_m, 180.0), Frame(0, WALL.y_max_m)
    fittings.towel_rail(room, north_face.moved(2.2, 0))
    decor.hooks(room, north_face.moved(0.9, 0, 1.6), ("accent", "second accent"))
    decor.painting(room, south_face.moved(-1.3, 0, 1.55), 0.45, 0.6, "oak")
    decor.painting(room, south_face.moved(-2.3, 0, 1.55), 0.45, 0.6, "oak")
    fittings.towel_ring(room, room.wall("west", 2.6, 1.35))
    for y in (0.95, 2.7):
        lamps.ceiling_lamp(room, Frame(2.7, y), 0.2, 0.9)
