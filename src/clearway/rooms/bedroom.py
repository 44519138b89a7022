"""The bedroom: 6.5 x 6.5 m, 102 cells; a dressing room and a study round the corner from the bed."""

from __future__ import annotations

from clearway.rooms import finishes, textures
from clearway.rooms.detail import FULL, Detail
from clearway.rooms.frame import Frame
from clearway.rooms.furniture import beds, decor, lamps, openings, seating, storage, tables_and_desks
from clearway.rooms.furniture.small import any_small_piece
from clearway.rooms.materials import varied
from clearway.rooms.room import Room
from clearway.rooms.shell import Column, Finish, add_surfaces, add_walls
from clearway.rooms.surfaces import pixels

WIDTH_M, DEPTH_M, HEIGHT_M = 6.5, 6.5, 2.6
DRESSING_WALL = Column(0.0, 4.19, 4.9, 4.31)
STUDY_WALL = Column(3.69, 1.6, 3.81, 4.19)
COLUMNS = (DRESSING_WALL, STUDY_WALL)


def build(seed: int, looks: bool, detail: Detail = FULL) -> Room:
    """The bedroom without its light."""
    room = Room("bedroom", WIDTH_M, DEPTH_M, HEIGHT_M, (0.25, 0.25), seed, looks, mirrored=seed % 2 == 1, detail=detail)
    add_walls(room, COLUMNS)
    if looks:
        add_surfaces(room, _finish(room), COLUMNS)
    _place_bed(room)
    _place_study(room)
    _place_dressing_room(room)
    return room


def _finish(room: Room) -> Finish:
    """Carpet with two rugs; paper on three walls, paint behind the bed."""
    colours = room.colours
    pile = textures.pile(room.rng, pixels(3), pixels(3), (0.66, 0.61, 0.54), (0.56, 0.51, 0.45))
    floor = finishes.with_rug(room, finishes.floor_of(room, pile), (2.0, 2.5), (2.6, 2.3))
    floor = finishes.with_rug(room, floor, (5.3, 2.6), (1.5, 1.5), "medallion", round_edge=True)
    pattern = textures.WALLPAPERS[int(room.rng.integers(len(textures.WALLPAPERS)))]
    boards = varied(room.rng, (0.86, 0.86, 0.84), 0.02)
    paint = finishes.painted_wall(room, "west", colours.feature_wall)
    walls = {
        "south": finishes.papered_wall(room, "south", colours.wall, pattern),
        "north": finishes.boarded_wall(
            room, "north", finishes.papered_wall(room, "north", colours.wall, "dots"), boards
        ),
        "east": finishes.papered_wall(room, "east", colours.wall, "stripes"),
        "west": finishes.boarded_wall(room, "west", paint, boards, 0.6),
    }
    partition = finishes.papered_wall(room, "south", varied(room.rng, colours.wall), "damask", 0.4)
    walls = {side: finishes.aged(room, side, wall) for side, wall in walls.items()}
    return Finish(floor, finishes.plain_ceiling(room), walls, finishes.aged(room, "south", partition))


def _place_bed(room: Room) -> None:
    """The bed with its head at the west wall, and what stands and hangs around it."""
    beds.double_bed(room, room.wall("west", 2.5, gap_m=1.09))
    for y in (1.4, 3.6):
        beds.nightstand(room, room.wall("west", y, gap_m=0.21))
    openings.window(room, room.wall("south", 2.0, 0.9), 1.6, 1.25)
    decor.painting(room, room.wall("west", 2.5, 1.6), 1.2, 0.6)
    decor.painting(room, STUDY_WALL.face("west", 2.9, 1.55), 0.6, 0.8)
    decor.painting(room, STUDY_WALL.face("west", 2.05, 1.55), 0.4, 0.55, "oak")
    decor.clock(room, DRESSING_WALL.face("south", 1.8, 1.8))
    decor.wall_shelf(room, DRESSING_WALL.face("south", 2.8, 1.6))
    lamps.ceiling_lamp(room, Frame(2.4, 2.4), 0.26, 1.2)


def _place_study(room: Room) -> None:
    """Desk and chair by the east window, bookcase, chest of drawers, armchair."""
    tables_and_desks.desk(room, room.wall("east", 2.25, gap_m=0.31), 1.3)
    seating.office_chair(room, Frame(5.65, 2.25, -90.0))
    storage.bookcase(room, STUDY_WALL.face("east", 2.75).moved(0, 0.165), 0.9)
    storage.drawers(room, room.wall("east", 3.525, gap_m=0.23), 0.95)
    decor.pot_plant(room, room.wall("east", 3.3, gap_m=0.22), 0.85)
    lamps.table_lamp(room, room.wall("east", 3.8, gap_m=0.22), 0.85, 0.9, "cream")
    seating.sofa(room, Frame(WIDTH_M - 0.5, 0.505, 90.0), 0.95, 0.85)
    openings.window(room, room.wall("east", 2.25, 1.0), 1.3, 1.15)
    decor.painting(room, room.wall("east", 0.6, 1.55), 0.5, 0.65, "oak")
    decor.painting(room, room.wall("south", 5.1, 1.55), 0.55, 0.7)
    decor.painting(room, room.wall("south", 4.35, 1.55), 0.55, 0.7)
    lamps.wall_lamp(room, STUDY_WALL.face("east", 1.95, 1.6))
    lamps.ceiling_lamp(room, Frame(5.0, 2.2), 0.22, 1.0)


def _place_dressing_room(room: Room) -> None:
    """Wardrobe and chest along the north wall, the door, hooks and a long mirror."""
    storage.wardrobe(room, room.wall("north", 1.36, gap_m=0.31), 2.0, depth_m=0.6)
    chest = room.wall("north", 4.25, gap_m=0.23)
    storage.drawers(room, chest, 1.2, rows=3, columns=3, front="white")
    decor.flowers(room, chest.moved(0.42, 0), 0.85)
    decor.ornament(room, chest.moved(-0.4, 0), 0.85)
    decor.mirror(room, room.wall("north", 4.25, 1.5), 0.8, 0.9, "brass")
    any_small_piece(room, Frame(WIDTH_M - 0.25, DEPTH_M - 0.25))
    openings.door(room, room.wall("east", 5.2))
    decor.hooks(room, DRESSING_WALL.face("north", 2.6, 1.65), ("second accent", "linen", "accent"))
    decor.painting(room, DRESSING_WALL.face("north", 1.2, 1.5), 0.8, 0.6)
    decor.painting(room, DRESSING_WALL.face("north", 4.0, 1.5), 0.5, 0.7, "oak")
    decor.painting(room, room.wall("west", 5.2, 1.55), 0.5, 0.7)
    decor.clock(room, room.wall("north", 3.0, 1.8), 0.15, "brass")
    lamps.ceiling_lamp(room, Frame(3.4, 5.1), 0.22, 1.1)
