"""The skeleton of a flat: its corridor or entrance hall, and the rectangles around it that are divided into rooms.

Coordinates are cells; the flat lies in a rectangle from (0, 0), and walls of one cell are between all parts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

DEPTHS = (5, 9)  # cells of a room away from its corridor, least and most
CORRIDOR_WIDTHS = (2, 2, 2, 3)
HALL_SIDES = (3, 5)
LEAST_LEG = 4  # cells of a corridor's leg beyond its bend


@dataclass(frozen=True)
class Block:
    """A rectangle of cells that is divided into rooms, side by side along the corridor.

    Attributes:
        low, high: x and z of its lowest and highest cell, both included.
        side: where the corridor is, "south", "north", "west" or "east".
        first, last: cells of the corridor along that side.
    """

    low: tuple[int, int]
    high: tuple[int, int]
    side: str
    first: int
    last: int

    @property
    def axis(self) -> int:
        """0 where rooms lie side by side along x, 1 along z."""
        return 0 if self.side in ("south", "north") else 1

    @property
    def area(self) -> int:
        """Cells in it."""
        return (self.high[0] - self.low[0] + 1) * (self.high[1] - self.low[1] + 1)


@dataclass(frozen=True)
class Skeleton:
    """A corridor and what is around it.

    Attributes:
        corridor: rectangles of cells, low and high, both included.
        blocks: around it.
    """

    corridor: tuple[tuple[tuple[int, int], tuple[int, int]], ...]
    blocks: tuple[Block, ...]


def between(rng: np.random.Generator, limits: tuple[int, int]) -> int:
    """A whole number between two, both included."""
    return int(rng.integers(limits[0], limits[1] + 1))


def one_row(length: int, rng: np.random.Generator) -> Skeleton:
    """Rooms on one side of a straight corridor."""
    width, depth = int(rng.choice(CORRIDOR_WIDTHS)), between(rng, (6, DEPTHS[1]))
    rooms = Block((0, width + 1), (length - 1, width + depth), "south", 0, length - 1)
    return Skeleton((((0, 0), (length - 1, width - 1)),), (rooms,))


def two_rows(length: int, rng: np.random.Generator) -> Skeleton:
    """Rooms on both sides of a straight corridor, perhaps one more at its end."""
    width, below, above = int(rng.choice(CORRIDOR_WIDTHS)), between(rng, DEPTHS), between(rng, DEPTHS)
    low, high, last = below + 1, below + width, length - 1
    top = high + 1 + above
    if rng.random() < 0.5:
        return Skeleton(
            (((0, low), (last, high)),),
            (Block((0, 0), (last, below - 1), "north", 0, last), Block((0, high + 2), (last, top), "south", 0, last)),
        )
    room = between(rng, (5, 8))  # at the end: over the whole width, or as far as the upper row
    end = last - room - 1
    reach = top if top < 14 and rng.random() < 0.5 else high
    return Skeleton(
        (((0, low), (end, high)),),
        (
            Block((0, 0), (end, below - 1), "north", 0, end),
            Block((0, high + 2), (end if reach == top else last, top), "south", 0, end),
            Block((end + 2, 0), (last, reach), "west", low, high),
        ),
    )


def l_shaped(length: int, rng: np.random.Generator) -> Skeleton:
    """Rooms along a corridor with a bend."""
    width, below, leg = int(rng.choice(CORRIDOR_WIDTHS)), between(rng, DEPTHS), between(rng, (LEAST_LEG, 9))
    low, high, last = below + 1, below + width, length - 1
    bend, top = between(rng, (6, max(6, length - width - 6))), below + width + leg
    return Skeleton(
        (((0, low), (bend + width - 1, high)), ((bend, high + 1), (bend + width - 1, top))),
        (
            Block((0, 0), (last, below - 1), "north", 0, bend + width - 1),
            Block((0, high + 2), (bend - 2, top), "south", 0, bend - 2),
            Block((bend + width + 1, low), (last, top), "west", low, top),
        ),
    )


def t_shaped(length: int, rng: np.random.Generator) -> Skeleton:
    """Rooms along a corridor with a branch."""
    width, below, leg = int(rng.choice(CORRIDOR_WIDTHS)), between(rng, DEPTHS), between(rng, (5, 10))
    low, high, last = below + 1, below + width, length - 1
    branch, top = between(rng, (6, max(6, length - width - 7))), below + width + leg
    legs = "east", "west"
    return Skeleton(
        (((0, low), (last, high)), ((branch, high + 1), (branch + width - 1, top))),
        (
            Block((0, 0), (last, below - 1), "north", 0, last),
            Block((0, high + 2), (branch - 2, top), legs[0], high + 2, top),
            Block((branch + width + 1, high + 2), (last, top), legs[1], high + 2, top),
        ),
    )


def around_hall(length: int, rng: np.random.Generator) -> Skeleton:
    """Rooms on two or three sides of an entrance hall."""
    wide, deep, above = between(rng, HALL_SIDES), between(rng, (3, 6)), between(rng, DEPTHS)
    left, top = between(rng, (5, 9)), deep + above
    right = length - left - wide - 2
    beside = Block((0, 0), (left - 1, top), "east", 0, deep - 1)
    first, last = left + 1, left + wide
    if right < 4 or deep < 4:  # nothing to the right
        return Skeleton(
            (((first, 0), (last, deep - 1)),),
            (beside, Block((first, deep + 1), (last + max(0, right), top), "south", first, last)),
        )
    return Skeleton(
        (((first, 0), (last, deep - 1)),),
        (
            beside,
            Block((first, deep + 1), (last + 1 + right, top), "south", first, last),
            Block((last + 2, 0), (last + 1 + right, deep - 1), "west", 0, deep - 1),
        ),
    )


FORMS: dict[str, tuple[Callable[[int, np.random.Generator], Skeleton], tuple[int, ...], tuple[int, int]]] = {
    "one row": (one_row, (2, 3, 4), (5, 7)),
    "two rows": (two_rows, (3, 4, 5, 6), (3, 5)),
    "L": (l_shaped, (3, 4, 5, 6), (3, 5)),
    "T": (t_shaped, (4, 5, 6), (3, 5)),
    "hall": (around_hall, (2, 3, 4), (5, 7)),
}
"""Each form: what draws it, of how many rooms, and cells of length a room, least and most."""
