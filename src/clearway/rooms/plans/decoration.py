"""What hangs on the walls of a floor plan's room and from its ceiling: windows, a door, pictures, lamps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from clearway.rooms.frame import Frame
from clearway.rooms.furniture import bathroom, decor, lamps, openings
from clearway.rooms.plans.layout import Layout, Stretch
from clearway.rooms.plans.walls import GAP
from clearway.rooms.room import Room

SLOT_M = 1.3  # of wall for one thing
LEAST_M = 0.45
MOST_WINDOWS = 5
MOST_WINDOWS_A_ROOM = 2  # where the plan has walls
WINDOWS_A_ROOM = (1, 2, 2, 3)  # at most, where it names its furniture
DOOR_M = 1.05  # of a stretch, SPARE_M aside, that a door takes
FRONT_DOOR_M = 0.74  # the same where the plan has walls: they go on beyond a stretch, by GAP of a cell
MOST_BEHIND_M = 1.3  # a piece of furniture higher than this hides what hangs behind it
LAMP_FLOOR_M2 = 7.0  # that one ceiling lamp lights
MOST_LAMPS = 16
PENDANT_M = 2.05  # height of a hanging lamp's rim
COVER_M = 0.02
ROUNDS = 10  # of k-means
CURTAIN_ROOM_M = 0.3  # nearer than that, a camera would look through curtains, and see nothing but lawn
PICTURE_HEIGHT_M = 1.15  # of its middle, to be seen by a camera close before it
PICTURES = 0.8  # of the places for them, where the plan has walls
SPARE_M = 0.25  # of a stretch that nothing hangs on


def decorate(room: Room, layout: Layout, tops_m: Sequence[float]) -> None:
    """Hang things on the walls, where furniture of heights `tops_m` leaves them open, and lamps from the ceiling."""
    _hang_lamps(room, layout)
    _cover_walls(room, layout)
    near_m, doors = (0.5 + GAP) * layout.cell_size_m, 0
    entrance, windows, most = _entrance(layout), Counter[int](), MOST_WINDOWS
    if layout.has_walls:
        most = MOST_WINDOWS_A_ROOM
    panes = 2
    if layout.has_named_furniture:
        most, panes = int(room.rng.choice(WINDOWS_A_ROOM)), int(room.rng.integers(1, 4))
    for stretch in layout.stretches:
        top_m = 0.0 if stretch.piece is None else tops_m[stretch.piece]
        if top_m > MOST_BEHIND_M:
            continue
        for at, length_m in _slots(stretch):
            usable_m = length_m - SPARE_M
            in_room = windows[stretch.room]
            window_here = stretch.outer and in_room < most and (top_m > 0 or near_m > CURTAIN_ROOM_M)
            if not doors and (stretch is entrance if layout.has_walls else top_m == 0 and usable_m > DOOR_M):
                openings.door(room, at)
                doors += 1
            elif window_here and usable_m > 0.7 and (room.rng.random() < 0.6 or not in_room):
                _window(room, at, usable_m, top_m, panes, between_walls=layout.has_walls)
                windows[stretch.room] += 1
            elif stretch.area is not None and stretch.area.use == "bathroom":
                _hang_in_bathroom(room, at, usable_m, top_m)
            elif not layout.has_walls or room.rng.random() < PICTURES:
                _hang(room, at, usable_m, top_m)


def _entrance(layout: Layout) -> Stretch | None:
    """The stretch with the front door where the plan has walls: an outer one, of a corridor if there is such."""
    fitting = [
        stretch
        for stretch in layout.stretches
        if stretch.outer
        and stretch.piece is None
        and any(length_m - SPARE_M > FRONT_DOOR_M for _, length_m in _slots(stretch))
    ]
    if not layout.has_walls or not fitting:
        return None
    return max(fitting, key=lambda stretch: stretch.area is not None and stretch.area.use == "corridor")


def _slots(stretch: Stretch) -> list[tuple[Frame, float]]:
    """The stretch in equal parts of some SLOT_M: middle and length; none where it is too short for anything."""
    if stretch.length_m < LEAST_M:
        return []
    count = max(1, round(stretch.length_m / SLOT_M))
    length_m = stretch.length_m / count
    return [(stretch.at.moved((number - (count - 1) / 2) * length_m, 0), length_m) for number in range(count)]


def _window(room: Room, at: Frame, usable_m: float, top_m: float, panes: int, *, between_walls: bool) -> None:
    """A window over furniture, or with curtains down to the floor; between walls inside they do not reach beyond it."""
    sill_m = max(0.9, top_m + 0.12)
    width_m, curtains = min(usable_m, 1.5), top_m == 0
    if between_walls:
        room_m = usable_m - 2 * openings.CURTAIN_REACH_M + SPARE_M
        curtains = curtains and room_m > 0.55
        width_m = min(width_m, room_m) if curtains else width_m
    openings.window(room, at.moved(0, 0, sill_m), width_m, 2.15 - sill_m, curtains, panes)


def _hang(room: Room, at: Frame, usable_m: float, top_m: float) -> None:
    """A picture or a clock at the height of the camera, or over the furniture."""
    height_m = min(0.75, max(0.35, usable_m))
    width_m = min(1.0, usable_m)
    middle = at.moved(0, 0, max(PICTURE_HEIGHT_M, top_m + 0.2 + height_m / 2))
    if room.rng.random() < 0.12:
        decor.clock(room, middle, min(0.16, usable_m / 2))
    else:
        decor.painting(room, middle, width_m, height_m, str(room.rng.choice(("black", "oak", "brass", "walnut"))))


def _hang_in_bathroom(room: Room, at: Frame, usable_m: float, top_m: float) -> None:
    """A towel rail, hooks with towels or a shelf, or a small picture over furniture; often nothing."""
    kind = int(room.rng.integers(4))
    if top_m == 0 and kind == 0 and usable_m > 0.55:
        bathroom.towel_rail(room, at)
    elif top_m == 0 and kind == 1 and usable_m > 0.7:
        decor.hooks(room, at.moved(0, 0, 1.6), ("accent", "linen"))
    elif top_m > 0 and kind < 2 and usable_m > 0.5:
        decor.wall_shelf(room, at.moved(0, 0, max(1.35, top_m + 0.35)), min(usable_m, 0.8), "white")
    elif kind == 2:
        _hang(room, at, min(usable_m, 0.5), top_m)


def _hang_lamps(room: Room, layout: Layout) -> None:
    """Ceiling lamps over free cells of every room, spread by k-means."""
    for number in np.unique(layout.rooms[layout.rooms > 0]).tolist() or [0]:
        places_m = layout.middles_m(np.argwhere(layout.free & (layout.rooms == number)))
        floor_m2 = len(places_m) * layout.cell_size_m**2
        count = int(np.clip(round(floor_m2 / LAMP_FLOOR_M2), 1, MOST_LAMPS))
        power = 1.1 * float(np.clip(np.sqrt(floor_m2 / LAMP_FLOOR_M2), 0.6, 1.0)) if layout.has_walls else 1.1
        hang = _lamp_of_a_room(room, power) if layout.has_named_furniture else None
        for x_m, y_m in _spread(places_m, min(count, len(places_m))):
            at = Frame(float(x_m), float(y_m))
            if hang is None:
                lamps.ceiling_lamp(room, at, 0.24, power)
            else:
                hang(at)


def _lamp_of_a_room(room: Room, power: float) -> Callable[[Frame], None]:
    """What hangs a lamp of the kind and colour that all lamps of a room have; its generator chooses."""
    colour = (lamps.WARM, lamps.NEUTRAL, lamps.COOL)[int(room.rng.integers(3))]
    kind, size_m = int(room.rng.integers(4)), float(room.rng.uniform(0.2, 0.3))
    metal = str(room.rng.choice(("black", "brass", "white", "chrome")))
    if kind == 0:
        return lambda at: lamps.ceiling_lamp(room, at, size_m, power, colour)
    if kind == 1:
        return lambda at: lamps.ceiling_panel(room, at, 2 * size_m, power, colour)
    if kind == 2:
        return lambda at: lamps.shade_lamp(room, at, power, colour)
    return lambda at: lamps.pendant(room, at, PENDANT_M, metal, power, colour)


def _spread(places_m: np.ndarray, count: int) -> list[np.ndarray]:
    """So many of (N, 2) places, each near the middle of those that are nearest to it."""
    centres_m = places_m[np.linspace(0, len(places_m) - 1, count).astype(int)]
    for _ in range(ROUNDS):
        nearest = np.linalg.norm(places_m[:, None] - centres_m, axis=2).argmin(axis=1)
        centres_m = np.array([places_m[nearest == number].mean(axis=0) for number in range(count)])
    return [places_m[np.linalg.norm(places_m - centre_m, axis=1).argmin()] for centre_m in centres_m]


def _cover_walls(room: Room, layout: Layout) -> None:
    """Covers on the solid parts, for the view from above; the ceiling hides them from within."""
    for wall in layout.walls:
        width_m, depth_m = wall.x_max_m - wall.x_min_m, wall.y_max_m - wall.y_min_m
        middle = Frame((wall.x_min_m + wall.x_max_m) / 2, (wall.y_min_m + wall.y_max_m) / 2)
        material = "beyond" if wall in layout.beyond else "trim"
        room.box(middle, (0, 0, room.height_m), (width_m, depth_m, COVER_M), material, segments=0)
