"""The kitchen: 8.5 x 8.0 m, 169 cells; cooking and dining on two sides of a wall."""

from __future__ import annotations

from clearway.rooms import finishes, textures
from clearway.rooms.detail import FULL, Detail
from clearway.rooms.finishes import WHITE
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import decor, kitchen, lamps, openings, seating, storage, tables_and_desks
from clearway.rooms.furniture.small import any_small_piece
from clearway.rooms.materials import varied
from clearway.rooms.room import Room
from clearway.rooms.shell import Column, Finish, add_surfaces, add_walls
from clearway.rooms.surfaces import pixels

WIDTH_M, DEPTH_M, HEIGHT_M = 8.5, 8.0, 2.7
DINING_WALL = Column(4.69, 0.0, 4.81, 5.9)
COLUMNS = (DINING_WALL,)


def build(seed: int, looks: bool, detail: Detail = FULL) -> Room:
    """The kitchen without its light."""
    room = Room("kitchen", WIDTH_M, DEPTH_M, HEIGHT_M, (0.25, 0.25), seed, looks, mirrored=seed % 2 == 1, detail=detail)
    add_walls(room, COLUMNS)
    if looks:
        add_surfaces(room, _finish(room), COLUMNS)
    _place_kitchen(room)
    _place_dining_room(room)
    return room


def _finish(room: Room) -> Finish:
    """Terracotta tiles; plain walls."""
    colours = room.colours
    tiles = textures.tiles(room.rng, pixels(4), pixels(4), 8, 8, (0.72, 0.62, 0.5), (0.52, 0.47, 0.4), 0.1, 0.25)
    floor = finishes.floor_of(room, tiles)
    accent = colours.second_accent
    walls = {
        side: finishes.tiled_wall(
            room, side, finishes.painted_wall(room, side, colours.wall), (0.9, 0.89, 0.86), 1.42, accent, 0.2
        )
        for side in ("south", "west")
    }
    paper = finishes.papered_wall(room, "north", colours.wall, "leaves")
    walls["north"] = finishes.boarded_wall(room, "north", paper, WHITE)
    paint = finishes.painted_wall(room, "east", colours.feature_wall)
    walls["east"] = finishes.boarded_wall(room, "east", paint, WHITE)
    partition = finishes.papered_wall(room, "south", varied(room.rng, colours.wall), "trellis", 0.4)
    walls = {side: finishes.aged(room, side, wall) for side, wall in walls.items()}
    return Finish(floor, finishes.plain_ceiling(room), walls, finishes.aged(room, "south", partition))


def _place_kitchen(room: Room) -> None:
    """Counters, cooker, fridge and pantry along the south and west walls, the island with its stools."""
    _place_south_counter(room)
    kitchen.counter(room, room.wall("west", 2.05, gap_m=0.31), 2.88)
    kitchen.fridge(room, room.wall("west", 3.9, gap_m=0.32))
    storage.wardrobe(room, room.wall("west", 4.8, gap_m=0.31), 1.0, 2.0, 0.6, "cabinet")
    kitchen.island(room, Frame(2.75, 2.5, 180.0), 1.9, 0.95)
    for x in (2.25, 2.75, 3.25):
        seating.bar_stool(room, Frame(x, 3.25))
    decor.fruit_bowl(room, Frame(2.3, 2.5), 0.9)
    kitchen.wall_cabinets(room, room.wall("west", 1.9), 2.4)
    west = room.wall("west", 2.0, gap_m=0.3)
    kitchen.microwave(room, west.moved(-0.8, -0.08))
    kitchen.toaster(room, west.moved(0.0, -0.1))
    kitchen.jars(room, west.moved(0.8, -0.15))
    any_small_piece(room, Frame(0.26, DEPTH_M - 0.26))
    decor.basket(room, Frame(0.26, 5.75), 0.6, "steel")
    storage.bookcase(room, room.wall("north", 1.25, gap_m=0.17))
    openings.door(room, room.wall("north", 3.0))
    for x in (2.3, 3.2):
        lamps.pendant(room, Frame(x, 2.45), 1.8, power=0.35)
    lamps.ceiling_lamp(room, Frame(2.6, 4.4), 0.28, 1.3)
    decor.painting(room, DINING_WALL.face("west", 3.0, 1.55), 0.6, 0.8)
    decor.painting(room, DINING_WALL.face("west", 4.0, 1.55), 0.6, 0.8)
    decor.clock(room, room.wall("north", 4.2, 1.8), 0.18)
    decor.hooks(room, DINING_WALL.face("west", 5.2, 1.6))
    decor.painting(room, DINING_WALL.face("west", 1.6, 1.35), 1.1, 0.9, "oak")


def _place_south_counter(room: Room) -> None:
    """Sink under the window, cooker with its hood, wall cabinets."""
    kitchen.counter(room, room.wall("south", 1.5, gap_m=0.31), 2.98)
    kitchen.cooker(room, room.wall("south", 3.3, gap_m=0.31))
    kitchen.counter(room, room.wall("south", 4.14, gap_m=0.31), 1.08)
    kitchen.sink(room, room.wall("south", 2.0, gap_m=0.31))
    kitchen.hood(room, room.wall("south", 3.3))
    kitchen.wall_cabinets(room, room.wall("south", 4.16), 1.0)
    kitchen.kettle(room, room.wall("south", 2.75, gap_m=0.3))
    kitchen.knife_block(room, room.wall("south", 4.2, gap_m=0.3))
    openings.window(room, room.wall("south", 1.9, 1.12), 1.3, 1.05, curtains=False)


def _place_dining_room(room: Room) -> None:
    """Table with eight chairs, sideboard, sofa, cabinet."""
    tables_and_desks.dining_table(room, Frame(6.75, 3.5, 90.0), 2.0, 1.0)
    for side in (-1, 1):
        for y in (2.85, 3.5, 4.15):
            seating.dining_chair(room, Frame(6.75 + side * 0.7, y, side * 90.0))
            tables_and_desks.place_setting(room, Frame(6.75 + side * 0.32, y, side * 90.0))
        seating.dining_chair(room, Frame(6.75, 3.5 + side * 1.2, 90.0 + side * 90.0))
    storage.sideboard(room, room.wall("east", 3.5, gap_m=0.22), 1.4)
    seating.sofa(room, room.wall("north", 7.5, gap_m=0.47), 1.5, 0.9)
    storage.bookcase(room, room.wall("south", 6.75, gap_m=0.17))
    openings.window(room, room.wall("east", 5.7, 0.95), 1.6, 1.3)
    openings.window(room, room.wall("east", 1.6, 0.95), 1.3, 1.3)
    decor.painting(room, room.wall("east", 3.5, 1.6), 1.0, 0.7, "oak")
    decor.painting(room, room.wall("north", 7.5, 1.6), 1.1, 0.6)
    decor.painting(room, room.wall("north", 5.8, 1.6), 0.6, 0.8, "oak")
    decor.painting(room, room.wall("south", 7.7, 1.6), 0.5, 0.7)
    decor.painting(room, room.wall("south", 5.6, 1.6), 0.5, 0.7)
    for y in (1.2, 3.0, 4.8):
        decor.painting(room, DINING_WALL.face("east", y, 1.6), 0.7, 0.5, "brass")
    lamps.wall_lamp(room, DINING_WALL.face("east", 2.1, 1.6))
    decor.wall_shelf(room, DINING_WALL.face("east", 3.9, 1.6))
    for y in (3.0, 4.0):
        lamps.pendant(room, Frame(6.75, y), 1.7, power=0.45)
    lamps.ceiling_lamp(room, Frame(6.6, 6.4), 0.25, 1.2)
    lamps.ceiling_lamp(room, Frame(6.6, 1.2), 0.2, 0.8)
