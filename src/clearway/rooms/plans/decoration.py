"""What hangs on the walls of a floor plan's room and from its ceiling: windows, a door, pictures, lamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.rooms.frame import Frame
from clearway.rooms.furniture import decor, lamps, openings
from clearway.rooms.plans.layout import GAP, Layout, Stretch
from clearway.rooms.room import Room

SLOT_M = 1.3  # of wall for one thing
LEAST_M = 0.45
MOST_WINDOWS = 5
MOST_BEHIND_M = 1.3  # a piece of furniture higher than this hides what hangs behind it
LAMP_FLOOR_M2 = 7.0  # that one ceiling lamp lights
MOST_LAMPS = 16
COVER_M = 0.02
ROUNDS = 10  # of k-means
CURTAIN_ROOM_M = 0.3  # nearer than that, a camera would look through curtains, and see nothing but lawn
PICTURE_HEIGHT_M = 1.15  # of its middle, to be seen by a camera close before it
SPARE_M = 0.25  # of a stretch that nothing hangs on


def decorate(room: Room, layout: Layout, tops_m: Sequence[float]) -> None:
    """Hang things on the walls, where furniture of heights `tops_m` leaves them open, and lamps from the ceiling."""
    _hang_lamps(room, layout)
    _cover_walls(room, layout)
    near_m, doors = (0.5 + GAP) * layout.cell_size_m, 0
    for stretch in layout.stretches:
        top_m = 0.0 if stretch.piece is None else tops_m[stretch.piece]
        if top_m > MOST_BEHIND_M:
            continue
        for at, length_m in _slots(stretch):
            usable_m = length_m - SPARE_M
            window_here = stretch.outer and len(room.windows) < MOST_WINDOWS and (top_m > 0 or near_m > CURTAIN_ROOM_M)
            if top_m == 0 and not doors and usable_m > 1.05:
                openings.door(room, at)
                doors += 1
            elif window_here and usable_m > 0.7 and (room.rng.random() < 0.6 or not room.windows):
                _window(room, at, usable_m, top_m)
            else:
                _hang(room, at, usable_m, top_m)


def _slots(stretch: Stretch) -> list[tuple[Frame, float]]:
    """The stretch in equal parts of some SLOT_M: middle and length; none where it is too short for anything."""
    if stretch.length_m < LEAST_M:
        return []
    count = max(1, round(stretch.length_m / SLOT_M))
    length_m = stretch.length_m / count
    return [(stretch.at.moved((number - (count - 1) / 2) * length_m, 0), length_m) for number in range(count)]


def _window(room: Room, at: Frame, usable_m: float, top_m: float) -> None:
    """A window over furniture, or with curtains down to the floor."""
    sill_m = max(0.9, top_m + 0.12)
    openings.window(room, at.moved(0, 0, sill_m), min(usable_m, 1.5), 2.15 - sill_m, curtains=top_m == 0)


def _hang(room: Room, at: Frame, usable_m: float, top_m: float) -> None:
    """A picture or a clock at the height of the camera, or over the furniture."""
    height_m = min(0.75, max(0.35, usable_m))
    width_m = min(1.0, usable_m)
    middle = at.moved(0, 0, max(PICTURE_HEIGHT_M, top_m + 0.2 + height_m / 2))
    if room.rng.random() < 0.12:
        decor.clock(room, middle, min(0.16, usable_m / 2))
    else:
        decor.painting(room, middle, width_m, height_m, str(room.rng.choice(("black", "oak", "brass", "walnut"))))


def _hang_lamps(room: Room, layout: Layout) -> None:
    """Ceiling lamps over free cells, spread by k-means."""
    places_m = layout.middles_m(np.argwhere(layout.free))
    count = int(np.clip(round(len(places_m) * layout.cell_size_m**2 / LAMP_FLOOR_M2), 1, MOST_LAMPS))
    count = min(count, len(places_m))
    centres_m = places_m[np.linspace(0, len(places_m) - 1, count).astype(int)]
    for _ in range(ROUNDS):
        nearest = np.linalg.norm(places_m[:, None] - centres_m, axis=2).argmin(axis=1)
        centres_m = np.array([places_m[nearest == number].mean(axis=0) for number in range(count)])
    for centre_m in centres_m:
        x_m, y_m = places_m[np.linalg.norm(places_m - centre_m, axis=1).argmin()]
        lamps.ceiling_lamp(room, Frame(float(x_m), float(y_m)), 0.24, 1.1)


def _cover_walls(room: Room, layout: Layout) -> None:
    """Covers on the solid parts, for the view from above; the ceiling hides them from within."""
    for wall in layout.walls:
        width_m, depth_m = wall.x_max_m - wall.x_min_m, wall.y_max_m - wall.y_min_m
        middle = Frame((wall.x_min_m + wall.x_max_m) / 2, (wall.y_min_m + wall.y_max_m) / 2)
        room.box(middle, (0, 0, room.height_m), (width_m, depth_m, COVER_M), "trim", segments=0)
