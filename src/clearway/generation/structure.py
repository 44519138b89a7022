"""The structure of a flat: rooms around a corridor or a hall, walls of one cell between them, and doors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.generation.blocks import FORMS, Block, Skeleton, between
from clearway.generation.furnish import is_connected

USES: dict[int, tuple[str, ...]] = {  # of a flat's rooms by their number, the largest room's first
    2: ("living room", "bathroom"),
    3: ("living room", "bedroom", "bathroom"),
    4: ("living room", "bedroom", "kitchen", "bathroom"),
    5: ("living room", "bedroom", "bedroom", "kitchen", "bathroom"),
    6: ("living room", "bedroom", "bedroom", "kitchen", "bathroom", "bathroom"),
}
LIMITS: dict[str, tuple[int, int, int]] = {  # least and most cells, least across
    "bathroom": (15, 40, 3),
    "kitchen": (20, 56, 4),
    "bedroom": (30, 70, 5),
    "living room": (40, 130, 5),
}
CORRIDOR = "corridor"
TRIES = 60
SIZE_NOISE = 0.2  # of a room's size where uses are given out by size
LEAST_LENGTH = 3  # cells of a room along the corridor
BITE_CHANCE = 0.6  # that a small room leaves what is behind it to its neighbour, which becomes an L
BITE_DEPTH = (4, 3)  # cells that the small room keeps, and that go to the neighbour, at least
SET_BACK_CHANCE = 0.25  # that a room's outer wall stands back
NOTCH_CHANCE = 0.45  # that a wall comes into a room: a chimney breast, a shaft, a cut corner
OPEN_CHANCE, OPENING_CHANCE = 0.55, 0.2  # that kitchen and living room are one, or have an opening between them
OPENING_CELLS = 2
OPEN_LEAST = 3  # cells of wall that goes, at least
WIDE_CHANCE = 0.4  # of a door of two cells to a living room
CORNER_CHANCE = 0.6  # that a door is near a corner of its room
SECOND_DOOR_CHANCE = 0.2  # of a door between two rooms, besides those to the corridor
KITCHEN_DOOR_CHANCE = 0.4  # that a kitchen open to the living room has a door to the corridor as well


@dataclass(frozen=True, eq=False)
class Structure:
    """A flat without furniture.

    Attributes:
        form: of its corridor, a key of `FORMS`.
        uses: of its rooms; the last is the corridor.
        numbers: (X, Z) int, the room that a cell lies in, from 1; 0 is wall or a door.
        doors: cells of openings in the walls between rooms.
    """

    form: str
    uses: tuple[str, ...]
    numbers: np.ndarray
    doors: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class _Room:
    """A rectangle of a block: cells along the corridor from `first` to `last`, `depth` away from it."""

    block: int
    first: int
    last: int
    depth: int

    @property
    def cells(self) -> int:
        return (self.last - self.first + 1) * self.depth


def draw_structure(rng: np.random.Generator) -> Structure | None:
    """A flat of two to six rooms; None where none was found."""
    count = int(rng.integers(min(USES), max(USES) + 1))
    names = [name for name, (_, counts, _) in FORMS.items() if count in counts]
    name = names[int(rng.integers(len(names)))]
    draw, _, lengths = FORMS[name]
    for _ in range(TRIES):
        skeleton = draw(between(rng, (lengths[0] * count, lengths[1] * count)), rng)
        rooms = _divided(skeleton.blocks, count, rng)
        uses = None if rooms is None else _given_out(rooms, USES[count], rng)
        if rooms is None or uses is None:
            continue
        numbers = _drawn(skeleton, rooms, uses, rng)
        structure = _with_doors(Structure(name, (*uses, CORRIDOR), numbers, ()), rng)
        if structure is not None:
            return structure
    return None


def _divided(blocks: Sequence[Block], count: int, rng: np.random.Generator) -> list[_Room] | None:
    """So many rooms in some blocks, each with a part of the corridor before it; None where they do not fit."""
    if len(blocks) > count or any(min(np.subtract(block.high, block.low)) < LEAST_LENGTH - 1 for block in blocks):
        return None
    shares = [1] * len(blocks)
    while sum(shares) < count:
        fullest = max(range(len(blocks)), key=lambda number: (blocks[number].area / shares[number], -number))
        shares[fullest] += 1
    rooms = []
    for number, (block, share) in enumerate(zip(blocks, shares, strict=True)):
        low, high = block.low[block.axis], block.high[block.axis]
        depth = block.high[1 - block.axis] - block.low[1 - block.axis] + 1
        spare = high - low + 1 - (share - 1) - share * LEAST_LENGTH
        if spare < 0:
            return None
        cuts = sorted(int(rng.integers(spare + 1)) for _ in range(share - 1))
        lengths = [LEAST_LENGTH + end - start for start, end in zip([0, *cuts], [*cuts, spare], strict=True)]
        first = low
        for length in lengths:
            if min(first + length - 1, block.last) < max(first, block.first):  # no wall to the corridor
                return None
            set_back = int(rng.integers(1, 3)) if depth >= 7 and rng.random() < SET_BACK_CHANCE else 0
            rooms.append(_Room(number, first, first + length - 1, depth - set_back))
            first += length + 1
    return rooms


def _given_out(rooms: Sequence[_Room], uses: Sequence[str], rng: np.random.Generator) -> list[str] | None:
    """A use for every room, by their size; None where one is too small, too large or too narrow for its use."""
    sizes = [room.cells * (1 + SIZE_NOISE * float(rng.uniform(-1, 1))) for room in rooms]
    order = sorted(range(len(rooms)), key=lambda number: -sizes[number])
    given = dict(zip(order, uses, strict=True))
    for number, room in enumerate(rooms):
        least, most, narrowest = LIMITS[given[number]]
        across = min(room.last - room.first + 1, room.depth)
        if not least <= room.cells <= most or across < narrowest:
            return None
    return [given[number] for number in range(len(rooms))]


def _drawn(skeleton: Skeleton, rooms: Sequence[_Room], uses: Sequence[str], rng: np.random.Generator) -> np.ndarray:
    """The map of a flat's rooms and, last, its corridor: rectangles, with bites and notches."""
    corners = [block.high for block in skeleton.blocks] + [high for _, high in skeleton.corridor]
    numbers = np.zeros(np.max(corners, axis=0) + 1, int)
    for low, high in skeleton.corridor:
        numbers[low[0] : high[0] + 1, low[1] : high[1] + 1] = len(rooms) + 1
    bites = _bites(rooms, uses, rng)
    for index, room in enumerate(rooms):
        block = skeleton.blocks[room.block]
        other, depth = bites.get(index, (index, room.depth))
        _fill(numbers, block, (room.first, room.last), (0, depth), index + 1)
        if other != index:
            ends = (room.first, room.last + 1) if other > index else (room.first - 1, room.last)
            _fill(numbers, block, ends, (depth + 1, min(room.depth, rooms[other].depth)), other + 1)
    for number, use in enumerate(uses, 1):
        if rng.random() < NOTCH_CHANCE:
            _notch(numbers, number, use, rng)
    return numbers


def _is_roomy(use: str) -> bool:
    return use in ("living room", "bedroom")


def _bites(rooms: Sequence[_Room], uses: Sequence[str], rng: np.random.Generator) -> dict[int, tuple[int, int]]:
    """Rooms that leave what is behind them to a roomy neighbour: its index, and the cells of depth that they keep."""
    found: dict[int, tuple[int, int]] = {}
    keeps, gives = BITE_DEPTH
    for index, room in enumerate(rooms):
        shallowest = max(keeps, -(-LIMITS[uses[index]][0] // (room.last - room.first + 1)))
        fitting = [
            (other, deepest)
            for other in (index - 1, index + 1)
            if 0 <= other < len(rooms) and rooms[other].block == room.block and _is_roomy(uses[other])
            if other not in (one for one, _ in found.values())
            if (deepest := min(room.depth, rooms[other].depth) - 1 - gives) >= shallowest
        ]
        if not _is_roomy(uses[index]) and fitting and rng.random() < BITE_CHANCE:
            other, deepest = fitting[int(rng.integers(len(fitting)))]
            found[index] = other, int(rng.integers(shallowest, deepest + 1))
    return found


def _fill(numbers: np.ndarray, block: Block, along: tuple[int, int], away: tuple[int, int], number: int) -> None:
    """Mark the cells of a block from first to last along its corridor, and so far away from it (half-open)."""
    across = 1 - block.axis
    if block.side in ("south", "west"):
        low, high = block.low[across] + away[0], block.low[across] + away[1]
    else:
        low, high = block.high[across] + 1 - away[1], block.high[across] + 1 - away[0]
    if block.axis == 0:
        numbers[along[0] : along[1] + 1, low:high] = number
    else:
        numbers[low:high, along[0] : along[1] + 1] = number


def _notch(numbers: np.ndarray, number: int, use: str, rng: np.random.Generator) -> None:
    """Make some cells of a room at a wall of it wall: a shaft, a chimney breast, a cut corner; if there is place."""
    inside = numbers == number
    x0, z0 = np.argwhere(inside).min(axis=0)
    x1, z1 = np.argwhere(inside).max(axis=0)
    sides = [int(rng.integers(1, 4)), 1][:: 1 if rng.random() < 0.5 else -1]
    if x1 - x0 + 1 - sides[0] < LIMITS[use][2] or z1 - z0 + 1 - sides[1] < LIMITS[use][2]:
        return
    along_x = sides[0] >= sides[1]
    x = int(rng.integers(x0, x1 - sides[0] + 2)) if along_x else int(rng.choice([x0, x1]))
    z = int(rng.choice([z0, z1])) if along_x else int(rng.integers(z0, z1 - sides[1] + 2))
    box = np.s_[x : x + sides[0], z : z + sides[1]]
    left = inside.copy()
    left[box] = False
    if inside[box].all() and is_connected(left) and left.sum() >= LIMITS[use][0]:
        numbers[box] = 0


def _with_doors(structure: Structure, rng: np.random.Generator) -> Structure | None:
    """The flat with its doors; None where a room has no wall to the corridor to put one in."""
    uses, numbers = structure.uses, structure.numbers.copy()
    corridor, kitchen = len(uses), (uses.index("kitchen") + 1 if "kitchen" in uses else 0)
    living = uses.index("living room") + 1
    shared = list(_walls_between(numbers, kitchen, living)) if kitchen else []
    kind = float(rng.random())
    is_open = len(shared) >= OPEN_LEAST and kind < OPEN_CHANCE
    if is_open:
        for cell in shared:
            numbers[cell] = living
    doors: list[tuple[int, int]] = []
    for number in range(1, corridor):
        if number == kitchen and is_open and rng.random() >= KITCHEN_DOOR_CHANCE:
            continue
        cells = _door_cells(numbers, number, corridor, uses[number - 1], rng)
        if not cells:
            return None
        doors += cells
    if not is_open and len(shared) >= OPEN_LEAST and kind < OPEN_CHANCE + OPENING_CHANCE:
        start = int(rng.integers(len(shared) - OPENING_CELLS + 1))
        doors += _in_line(shared[start : start + OPENING_CELLS])
    elif rng.random() < SECOND_DOOR_CHANCE:
        doors += _door_between_rooms(numbers, uses, rng)
    return replace(structure, numbers=numbers, doors=tuple(doors))


def _walls_between(numbers: np.ndarray, one: int, other: int) -> Iterator[tuple[int, int]]:
    """Cells of wall with one room on one side and another room on the opposite one; wall at their two other sides."""
    around = np.pad(numbers, 1)
    for axis in (0, 1):
        sides = ((around[:-2, 1:-1], around[2:, 1:-1]), (around[1:-1, :-2], around[1:-1, 2:]))
        (before, after), (left, right) = sides[axis], sides[1 - axis]
        meets = ((before == one) & (after == other)) | ((before == other) & (after == one))
        yield from map(_cell, np.argwhere((numbers == 0) & meets & (left == 0) & (right == 0)))


def _cell(row: np.ndarray) -> tuple[int, int]:
    return int(row[0]), int(row[1])


def _in_line(cells: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """The cells, if they are side by side; else the first."""
    first, last = cells[0], cells[-1]
    apart = abs(first[0] - last[0]) + abs(first[1] - last[1])
    return list(cells) if apart == len(cells) - 1 else [first]


def _door_cells(
    numbers: np.ndarray, number: int, corridor: int, use: str, rng: np.random.Generator
) -> list[tuple[int, int]]:
    """The cells of a room's door to the corridor: one, or two of a living room; none where they share no wall."""
    shared = list(_walls_between(numbers, number, corridor))
    if not shared:
        return []
    if rng.random() < CORNER_CHANCE:
        ends = [1, len(shared) - 2] if len(shared) > 3 else [0, len(shared) - 1]
        start = ends[int(rng.integers(2))]
    else:
        start = int(rng.integers(len(shared)))
    wide = use == "living room" and rng.random() < WIDE_CHANCE
    return _in_line(shared[start : start + 2]) if wide else [shared[start]]


def _door_between_rooms(numbers: np.ndarray, uses: Sequence[str], rng: np.random.Generator) -> list[tuple[int, int]]:
    """A door between two rooms with a wall in common: none, or one, of a bedroom to a bathroom or a living room."""
    pairs = [
        (one, other)
        for one, use in enumerate(uses, 1)
        for other, beyond in enumerate(uses, 1)
        if use == "bedroom" and beyond in ("bathroom", "living room")
    ]
    walls = [wall for pair in pairs if (wall := list(_walls_between(numbers, *pair)))]
    if not walls:
        return []
    wall = walls[int(rng.integers(len(walls)))]
    return [wall[int(rng.integers(len(wall)))]]
