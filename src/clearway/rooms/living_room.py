"""The living room: 8.0 x 6.5 m, 117 cells; a library and a dining room round the corners from the sofas."""

from __future__ import annotations

from clearway.rooms import finishes
from clearway.rooms.detail import FULL, Detail
from clearway.rooms.finishes import WHITE
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import decor, lamps, openings, seating, storage, tables_and_desks
from clearway.rooms.furniture.small import any_small_piece
from clearway.rooms.materials import varied
from clearway.rooms.room import Room
from clearway.rooms.shell import Column, Finish, add_surfaces, add_walls

WIDTH_M, DEPTH_M, HEIGHT_M = 8.0, 6.5, 2.7
DINING_WALL = Column(4.69, 2.6, 4.81, 6.5)
LIBRARY_WALL = Column(1.6, 4.69, 4.69, 4.81)
COLUMNS = (DINING_WALL, LIBRARY_WALL)


def build(seed: int, looks: bool, detail: Detail = FULL) -> Room:
    """The living room without its light."""
    room = Room(
        "living_room", WIDTH_M, DEPTH_M, HEIGHT_M, (0.25, 0.25), seed, looks, mirrored=seed % 2 == 1, detail=detail
    )
    add_walls(room, COLUMNS)
    if looks:
        add_surfaces(room, _finish(room), COLUMNS)
    _place_sofas(room)
    _place_dining_room(room)
    _place_library(room)
    return room


def _finish(room: Room) -> Finish:
    """Planks with two rugs; striped paper, paint in the library and the dining room."""
    colours = room.colours
    wood = finishes.plank_floor(room) if room.rng.random() < 0.6 else finishes.parquet_floor(room)
    floor = finishes.with_rug(room, wood, (1.9, 2.4), (2.2, 2.6))
    floor = finishes.with_rug(room, floor, (6.5, 3.5), (2.6, 2.6), "medallion", round_edge=True)
    paint = finishes.painted_wall(room, "north", colours.feature_wall)
    partition = finishes.papered_wall(room, "south", varied(room.rng, colours.wall), "trellis", 0.33)
    walls = {
        "south": finishes.papered_wall(room, "south", colours.wall, "stripes"),
        "north": finishes.boarded_wall(room, "north", paint, WHITE),
        "east": finishes.papered_wall(room, "east", colours.wall, "damask"),
        "west": finishes.boarded_wall(
            room, "west", finishes.papered_wall(room, "west", colours.wall, "leaves", 0.4), colours.cabinet, 0.8
        ),
    }
    walls = {side: finishes.aged(room, side, wall) for side, wall in walls.items()}
    return Finish(floor, finishes.plain_ceiling(room), walls, finishes.aged(room, "south", partition))


def _place_sofas(room: Room) -> None:
    """Sofa, armchairs and coffee table before the television."""
    storage.television(room, room.wall("west", 2.5, gap_m=0.22), 1.8)
    seating.sofa(room, Frame(2.8, 2.5, 90.0), 2.0, 0.9)
    seating.sofa(room, Frame(2.0, 4.0, 180.0), 0.95, 0.85, "second accent")
    tables_and_desks.coffee_table(room, Frame(1.75, 2.5, 90.0), 1.2, 0.5)
    corner = Frame(3.0, 3.75)
    tables_and_desks.side_table(room, corner)
    lamps.table_lamp(room, corner, 0.55)
    any_small_piece(room, Frame(0.26, 3.75))
    lamps.floor_lamp(room, Frame(0.25, 1.25))
    storage.bookcase(room, DINING_WALL.face("west", 3.25).moved(0, 0.165))
    storage.sideboard(room, room.wall("south", 3.9, gap_m=0.22), 1.2)
    openings.window(room, room.wall("south", 2.0, 0.95), 1.9, 1.3)
    openings.door(room, room.wall("west", 0.62))
    decor.painting(room, room.wall("south", 3.9, 1.55), 0.9, 0.65)
    decor.painting(room, room.wall("west", 3.75, 1.85), 0.45, 0.45)
    decor.painting(room, LIBRARY_WALL.face("south", 2.0, 1.55), 0.9, 0.65)
    decor.painting(room, LIBRARY_WALL.face("south", 3.3, 1.55), 0.5, 0.7, "oak")
    decor.clock(room, DINING_WALL.face("west", 4.2, 1.7))
    lamps.ceiling_lamp(room, Frame(1.9, 2.5), 0.28, 1.5)


def _place_dining_room(room: Room) -> None:
    """Table with six chairs, sideboard, fireplace."""
    middle = Frame(6.5, 3.5)
    tables_and_desks.dining_table(room, Frame(6.5, 3.5, 90.0), 1.6, 0.9)
    for side in (-1, 1):
        for y in (3.05, 3.95):
            seating.dining_chair(room, Frame(6.5 + side * 0.65, y, side * 90.0))
            tables_and_desks.place_setting(room, Frame(6.5 + side * 0.27, y, side * 90.0))
        seating.dining_chair(room, Frame(6.5, 3.5 + side * 1.02, 90.0 + side * 90.0))
    storage.sideboard(room, room.wall("north", 6.3, gap_m=0.22), 1.4)
    storage.fireplace(room, room.wall("east", 1.0, gap_m=0.21))
    any_small_piece(room, Frame(WIDTH_M - 0.26, DEPTH_M - 0.26))
    openings.window(room, room.wall("east", 3.5, 0.95), 1.8, 1.3)
    openings.window(room, room.wall("south", 6.3, 0.95), 1.2, 1.3)
    decor.painting(room, room.wall("east", 1.0, 1.7), 0.9, 0.65, "brass")
    decor.painting(room, room.wall("north", 6.3, 1.55), 1.0, 0.7, "oak")
    decor.painting(room, room.wall("east", 5.5, 1.55), 0.6, 0.8)
    decor.painting(room, DINING_WALL.face("east", 2.9, 1.55), 0.3, 0.6)
    decor.mirror(room, DINING_WALL.face("east", 3.5, 1.5), 0.7, 1.0, "brass")
    decor.wall_shelf(room, DINING_WALL.face("east", 4.9, 1.6), 0.9)
    lamps.pendant(room, middle, 1.7, power=0.6)
    lamps.ceiling_lamp(room, Frame(6.5, 1.3), 0.22, 0.9)
    lamps.ceiling_lamp(room, Frame(6.5, 5.4), 0.22, 0.7)


def _place_library(room: Room) -> None:
    """Bookcases and a reading chair at the end."""
    for x in (2.2, 3.1, 4.0):
        storage.bookcase(room, room.wall("north", x, gap_m=0.17))
    seating.sofa(room, Frame(4.12, 5.27, 90.0), 0.95, 0.85)
    tables_and_desks.desk(room, LIBRARY_WALL.face("north", 2.46).moved(0, 0.31), 1.3)
    decor.plant(room, Frame(0.26, DEPTH_M - 0.26), 1.3, "cream")
    openings.window(room, room.wall("west", 5.4, 0.95), 1.1, 1.2)
    decor.painting(room, LIBRARY_WALL.face("north", 2.3, 1.55), 0.6, 0.8)
    decor.painting(room, LIBRARY_WALL.face("north", 3.2, 1.55), 0.6, 0.8)
    lamps.wall_lamp(room, DINING_WALL.face("west", 5.3, 1.6))
    decor.painting(room, room.wall("north", 1.1, 1.55), 0.5, 0.7, "brass")
    lamps.ceiling_lamp(room, Frame(2.4, 5.5), 0.22, 1.0)
