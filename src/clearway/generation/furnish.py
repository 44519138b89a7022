"""Furniture as blocked cells: what a room of some use has, mostly along its walls, with ways left between.

A piece is set down only where all free cells of the room stay connected, every piece can be walked up to, and no more
dead ends arise than asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from clearway.generation.catalogue import FURTHER, KEY, MORE, SECOND_CHANCE, SHARES, SNUG, Furniture

TRIES = 10  # of places for a piece
KEY_TRIES = 60  # of places for one that the room must have
MOST_PIECES = 24
DEAD_END_CHANCE = 0.5  # that a piece may leave one
BEFORE_CELLS = 2  # from a sofa to its table, at most
STEPS = {"south": (0, -1), "north": (0, 1), "west": (-1, 0), "east": (1, 0)}
OPPOSITE = {"south": "north", "north": "south", "west": "east", "east": "west"}


@dataclass(frozen=True)
class Place:
    """A box of cells for a piece, half-open, and the side that its front looks to."""

    x0: int
    z0: int
    x1: int
    z1: int
    front: str

    @property
    def cells(self) -> tuple[slice, slice]:
        """It as an index of a map."""
        return np.s_[self.x0 : self.x1, self.z0 : self.z1]

    def beyond(self, side: str, deep: int = 1) -> Place:
        """The box of so many cells just beyond one side."""
        x0, z0, x1, z1 = self.x0, self.z0, self.x1, self.z1
        return {
            "south": Place(x0, z0 - deep, x1, z0, side),
            "north": Place(x0, z1, x1, z1 + deep, side),
            "west": Place(x0 - deep, z0, x0, z1, side),
            "east": Place(x1, z0, x1 + deep, z1, side),
        }[side]

    def meets(self, other: Place) -> bool:
        """Whether they share a cell."""
        return self.x0 < other.x1 and other.x0 < self.x1 and self.z0 < other.z1 and other.z0 < self.z1


@dataclass(frozen=True)
class Zone:
    """A part of a room with a use of its own; most rooms are one.

    Attributes:
        use: a key of `SHARES`.
        inside: (X, Z) bool, its cells.
    """

    use: str
    inside: np.ndarray


@dataclass(frozen=True)
class Furnished:
    """A room with furniture.

    Attributes:
        inside: (X, Z) bool, its cells; all others are wall.
        free: (X, Z) bool, those that stay free, all of them connected.
        pieces: what stands where.
    """

    inside: np.ndarray
    free: np.ndarray
    pieces: tuple[tuple[Furniture, Place], ...] = ()


def furnished(zones: Sequence[Zone], kept: np.ndarray, rng: np.random.Generator) -> Furnished | None:
    """A room with furniture; None where what it must have finds no place.

    Args:
        zones: its parts, without walls between them.
        kept: (X, Z) bool, cells that must stay free, before doors for example.
        rng: chooses.
    """
    inside = np.logical_or.reduce([zone.inside for zone in zones])
    so_far = Furnished(inside, inside)
    for zone in zones:
        for group in KEY[zone.use]:
            swapped = len(group) > 1 and rng.random() < SECOND_CHANCE
            with_key = _with_one_of(so_far, (group[1], group[0], *group[2:]) if swapped else group, zone, kept, rng)
            if with_key is None:
                return None
            so_far = with_key
    for zone in zones:
        so_far = _filled(so_far, zone, kept, rng)
    return so_far


def _with_one_of(
    so_far: Furnished, group: Sequence[Furniture], zone: Zone, kept: np.ndarray, rng: np.random.Generator
) -> Furnished | None:
    """The room with the first piece of a group that finds a place."""
    found = (_with_piece(so_far, piece, zone, kept, rng, must=True) for piece in group)
    return next((room for room in found if room is not None), None)


def _filled(so_far: Furnished, zone: Zone, kept: np.ndarray, rng: np.random.Generator) -> Furnished:
    """The room with what a zone has besides what it must have, up to its share of cells."""
    least, most = SHARES[zone.use]
    wanted = (least + (most - least) * float(rng.random())) * zone.inside.sum()
    pieces = [piece for piece in MORE[zone.use] if rng.random() < piece.chance]
    further = FURTHER[zone.use]
    for number in range(MOST_PIECES):
        taken = zone.inside.sum() - (so_far.free & zone.inside).sum()
        if taken >= wanted or (number >= len(pieces) and not further):
            break
        piece = pieces[number] if number < len(pieces) else further[int(rng.integers(len(further)))]
        if not (piece.once and any(one.kind == piece.kind for one, _ in so_far.pieces)):
            so_far = _with_piece(so_far, piece, zone, kept, rng) or so_far
    return so_far


def _with_piece(
    so_far: Furnished, piece: Furniture, zone: Zone, kept: np.ndarray, rng: np.random.Generator, *, must: bool = False
) -> Furnished | None:
    """The room once a piece is set down; None where a place was not found. One that it must have may be shorter."""
    free = so_far.free
    length = int(rng.integers(piece.lengths[0], piece.lengths[1] + 1))
    lengths = range(length, piece.lengths[0] - 1, -1) if must else (length,)
    most_dead_ends = int(dead_ends(free).sum()) + (1 if must else int(rng.random() < DEAD_END_CHANCE))
    for tried in lengths:
        places = list(places_for(free & zone.inside & ~kept, so_far.inside, tried, piece))
        for place in _in_turn(places, piece, so_far, zone, rng)[: KEY_TRIES if must else TRIES]:
            left = free.copy()
            left[place.cells] = False
            pieces = (*so_far.pieces, (piece, place))
            if int(dead_ends(left).sum()) > most_dead_ends or not all(_in_reach(left, *one) for one in pieces):
                continue
            if left.any() and is_connected(left):
                return Furnished(so_far.inside, left, pieces)
    return None


def _in_turn(
    places: list[Place], piece: Furniture, so_far: Furnished, zone: Zone, rng: np.random.Generator
) -> list[Place]:
    """Places in the order in which they are tried: those near what the piece belongs to, if there are such, first."""
    order = [places[index] for index in rng.permutation(len(places))]
    if rng.random() < SNUG[zone.use]:
        around = np.pad(~so_far.free, 1, constant_values=True)
        order.sort(key=lambda place: -_touched(around, place))
    if piece.near is not None:
        kind, relation = piece.near
        others = [place for one, place in so_far.pieces if one.kind == kind]
        order.sort(key=lambda place: not any(_stands_to(place, other, relation) for other in others))
    return order


def _touched(around: np.ndarray, place: Place) -> float:
    """Share of the sides of a place where something stands, of a padded map of what is not free."""
    beyond = [place.beyond(side) for side in STEPS]
    touching = [around[one.x0 + 1 : one.x1 + 1, one.z0 + 1 : one.z1 + 1] for one in beyond]
    return float(sum(cells.sum() for cells in touching) / sum(cells.size for cells in touching))


def _stands_to(place: Place, other: Place, relation: str) -> bool:
    """Whether a place stands to another one as a relation of `Furniture.near` asks."""
    if relation == "beside":
        sides = ("west", "east") if other.front in ("south", "north") else ("south", "north")
        return place.front == other.front and any(place.meets(other.beyond(side)) for side in sides)
    ahead = other.beyond(other.front, 99 if relation == "facing" else BEFORE_CELLS)
    return place.meets(ahead) and (relation == "before" or place.front == OPPOSITE[other.front])


def _in_reach(free: np.ndarray, piece: Furniture, place: Place) -> bool:
    """Whether a free cell is before a piece, or, if it can be used all round, anywhere beside it."""
    width, depth = free.shape
    for side in STEPS if piece.all_round else (place.front,):
        one = place.beyond(side)
        if free[max(0, one.x0) : min(width, one.x1), max(0, one.z0) : min(depth, one.z1)].any():
            return True
    return False


def places_for(usable: np.ndarray, inside: np.ndarray, length: int, piece: Furniture) -> Iterator[Place]:
    """Where a piece may stand, whatever is cut off by it; in a fixed order.

    Args:
        usable: (X, Z) bool, cells that it may stand on.
        inside: (X, Z) bool, the room's cells; all others are wall.
        length: cells along its back.
        piece: what it is.
    """
    depth = piece.depth
    if piece.free_standing:
        roomy = ndimage.minimum_filter(usable, size=3, mode="constant", cval=False)
        for fronts, width, deep in ((("south", "north"), length, depth), (("west", "east"), depth, length)):
            for x, z in np.argwhere(_all_in(roomy, width, deep)).tolist():
                yield Place(x, z, x + width, z + deep, fronts[(x + z) % 2])
        return
    beyond = ~np.pad(inside, 1)
    for front, (dx, dz) in STEPS.items():
        width, deep = (length, depth) if dx == 0 else (depth, length)
        at_wall = beyond[1 - dx : beyond.shape[0] - 1 - dx, 1 - dz : beyond.shape[1] - 1 - dz]  # behind each cell
        backs = _all_in(at_wall, *((length, 1) if dx == 0 else (1, length)))
        shift_x, shift_z = (width - 1 if dx < 0 else 0), (deep - 1 if dz < 0 else 0)
        fits = _all_in(usable, width, deep)
        backed = backs[shift_x : shift_x + fits.shape[0], shift_z : shift_z + fits.shape[1]]
        for x, z in np.argwhere(fits & backed).tolist():
            yield Place(x, z, x + width, z + deep, front)


def _all_in(marked: np.ndarray, width: int, depth: int) -> np.ndarray:
    """Whether the box of that size from each cell on is marked throughout, bool; empty where none fits."""
    if width > marked.shape[0] or depth > marked.shape[1]:
        return np.zeros((max(0, marked.shape[0] - width + 1), max(0, marked.shape[1] - depth + 1)), bool)
    windows = np.lib.stride_tricks.sliding_window_view(marked, (width, depth))
    return np.asarray(windows.all(axis=(2, 3)))


def is_connected(free: np.ndarray) -> bool:
    """Whether the free cells, (X, Z) bool, are one connected part."""
    _, count = ndimage.label(free)
    return bool(count == 1)


def dead_ends(free: np.ndarray) -> np.ndarray:
    """The free cells with at most one free neighbour, (X, Z) bool."""
    around = np.pad(free, 1).astype(int)
    neighbours = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
    return free & (neighbours <= 1)
