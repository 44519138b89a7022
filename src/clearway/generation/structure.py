"""The structure of a flat: two rows of rooms along a corridor, perhaps one at its end, with walls of one cell between.

Coordinates are cells; the corridor runs along x, and its lowest row is z = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.scenes.floor_plans import Area

USES: dict[int, tuple[str, ...]] = {  # of a flat's rooms, by their number
    2: ("living room", "bathroom"),
    3: ("living room", "bathroom", "bedroom"),
    4: ("living room", "bathroom", "bedroom", "kitchen"),
    5: ("living room", "bathroom", "bedroom", "kitchen", "bedroom"),
    6: ("living room", "bathroom", "bedroom", "kitchen", "bedroom", "bathroom"),
}
SIZES = {  # cells along the corridor, then away from it; least and most
    "bathroom": ((4, 6), (5, 7)),
    "kitchen": ((5, 8), (6, 8)),
    "bedroom": ((6, 8), (6, 8)),
    "living room": ((8, 11), (7, 9)),
}
MOST_STRETCH = {"bathroom": 1, "kitchen": 3, "bedroom": 2, "living room": 3}  # cells, so that both rows end alike
CHOICES = 3  # of the ways to divide rooms into two rows, the most balanced ones
EVEN_CHANCE = 0.75  # that the rooms of a row are equally deep
MOST_ACROSS = 16  # cells of a living room at the corridor's end
END_CHANCE = 0.5  # that a flat of four rooms or more has one at the corridor's end
OPENING_CHANCE = 0.5  # of a wide opening between kitchen and living room, where they are neighbours
OPENING_CELLS = 2
SHARED_LEAST = 3  # cells of wall that two rooms share where there is an opening


@dataclass(frozen=True)
class Structure:
    """A flat without furniture.

    Attributes:
        areas: its rooms and, last, its corridor, without walls; none touch.
        doors: cells of openings in the walls between areas.
    """

    areas: tuple[Area, ...]
    doors: tuple[tuple[int, int], ...]


def draw_structure(rng: np.random.Generator) -> Structure:
    """A flat of two to six rooms."""
    uses = list(USES[int(rng.integers(min(USES), max(USES) + 1))])
    uses = [uses[index] for index in rng.permutation(len(uses))]
    width = int(rng.choice([1, 2, 2, 2, 3]))  # of the corridor
    at_end = None
    if len(uses) >= 4 and rng.random() < END_CHANCE:
        at_end = uses.pop(uses.index("living room"))
    rows = _rows(uses, rng)
    rooms = [*_placed(rows[0], -2, -1, rng), *_placed(rows[1], width + 1, 1, rng)]
    end = max(room.high[0] for room in rooms)
    corridor = Area("corridor", (0, 0), (_corridor_end(rooms, end, at_end is not None, rng), width - 1))
    doors = [door for room in rooms for door in _doors_to(room, corridor, rng)]
    if at_end is not None:
        rooms.append(_room_at_end(at_end, end + 2, rooms, width, rng))
        doors += [(end + 1, z) for z in range(min(width, OPENING_CELLS))]
    doors += _openings(rooms, rng)
    return Structure((*rooms, corridor), tuple(doors))


def _between(rng: np.random.Generator, limits: tuple[int, int]) -> int:
    return int(rng.integers(limits[0], limits[1] + 1))


def _rows(uses: Sequence[str], rng: np.random.Generator) -> tuple[list[tuple[str, int]], list[tuple[str, int]]]:
    """Uses and lengths of the rooms on both sides of the corridor: divided well, and stretched to end alike."""
    lengths = [_between(rng, SIZES[use][0]) for use in uses]
    divisions = sorted(
        range(1, 2 ** len(uses) - 1), key=lambda bits: (abs(_lead(bits, lengths)), bits)
    )  # a bit a room: which side
    bits = divisions[int(rng.integers(min(CHOICES, len(divisions))))]
    rows: tuple[list[tuple[str, int]], list[tuple[str, int]]] = ([], [])
    for number, (use, length) in enumerate(zip(uses, lengths, strict=True)):
        rows[bits >> number & 1].append((use, length))
    for shorter, longer in ((rows[0], rows[1]), (rows[1], rows[0])):
        lacking = _length(longer) - _length(shorter)
        for index, (use, length) in enumerate(shorter):
            more = min(max(0, lacking), MOST_STRETCH[use])
            shorter[index] = use, length + more
            lacking -= more
    return rows


def _lead(bits: int, lengths: Sequence[int]) -> int:
    """Cells by which one row would be longer than the other, with the rooms of the set bits in it."""
    return sum((length + 1) * (1 if bits >> number & 1 else -1) for number, length in enumerate(lengths))


def _length(row: Sequence[tuple[str, int]]) -> int:
    """Cells from the start of a row to its end, walls between its rooms included."""
    return sum(length + 1 for _, length in row) - 1 if row else 0


def _placed(row: Sequence[tuple[str, int]], z: int, away: int, rng: np.random.Generator) -> list[Area]:
    """The rooms of a row whose cells nearest to the corridor lie at `z`; `away` from it is +1 or -1."""
    depths = [_between(rng, SIZES[use][1]) for use, _ in row]
    if rng.random() < EVEN_CHANCE:
        depths = [round(sum(depths) / len(depths))] * len(row)
    rooms, x = [], 0
    for (use, length), depth in zip(row, depths, strict=True):
        far = z + away * (depth - 1)
        rooms.append(Area(use, (x, min(z, far)), (x + length - 1, max(z, far))))
        x += length + 1
    return rooms


def _corridor_end(rooms: Sequence[Area], end: int, to_the_end: bool, rng: np.random.Generator) -> int:
    """Last cell of the corridor along x: no longer than the doors of all rooms need, unless a room is at its end."""
    if to_the_end:
        return end
    reached = max(room.low[0] for room in rooms)
    return min(end, reached + _between(rng, (2, 4)))


def _doors_to(room: Area, corridor: Area, rng: np.random.Generator) -> list[tuple[int, int]]:
    """The cells of a room's door to the corridor: one, or two of a living room; mostly near a corner of the room."""
    low, high = room.low[0], min(room.high[0], corridor.high[0])
    z = corridor.high[1] + 1 if room.low[1] > corridor.high[1] else corridor.low[1] - 1
    wide = room.use == "living room" and high - low >= 3 and rng.random() < 0.5
    places = range(low, high + (0 if wide else 1))
    inner = [x for x in places if low < x < high] or list(places)
    x = int(rng.choice([inner[0], inner[-1], inner[int(rng.integers(len(inner)))]]))
    return [(x, z), (x + 1, z)] if wide else [(x, z)]


def _room_at_end(use: str, x: int, rows: Sequence[Area], width: int, rng: np.random.Generator) -> Area:
    """The room behind the corridor's end: as wide as the flat, where that is not too wide, else even with one side."""
    low, high = min(room.low[1] for room in rows), max(room.high[1] for room in rows)
    across, along = _between(rng, SIZES[use][0]), _between(rng, SIZES[use][1])
    if high - low + 1 > MOST_ACROSS:
        low, high = (low, max(low + across, width) - 1) if rng.random() < 0.5 else (min(high - across + 1, 0), high)
    return Area(use, (x, low), (x + along - 1, high))


def _openings(rooms: Sequence[Area], rng: np.random.Generator) -> list[tuple[int, int]]:
    """Cells of openings between kitchens and living rooms that share a wall across x."""
    found: list[tuple[int, int]] = []
    for one in rooms:
        for other in rooms:
            shared = (max(one.low[1], other.low[1]), min(one.high[1], other.high[1]))
            if {one.use, other.use} != {"kitchen", "living room"} or one.high[0] + 2 != other.low[0]:
                continue
            if shared[1] - shared[0] + 1 < SHARED_LEAST or rng.random() >= OPENING_CHANCE:
                continue
            z = int(rng.integers(shared[0], shared[1] - OPENING_CELLS + 2))
            found += [(one.high[0] + 1, z + step) for step in range(OPENING_CELLS)]
    return found
