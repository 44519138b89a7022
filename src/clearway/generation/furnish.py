"""Furniture as blocked cells: what a room of some use has, mostly along its walls, with ways left between.

A piece is set only where all free cells of the room stay connected, and where no more dead ends arise than asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

TRIES = 10  # of places for a piece
MOST_PIECES = 24
DEAD_END_CHANCE = 0.5  # that a piece may leave one


@dataclass(frozen=True)
class Furniture:
    """A kind of furniture.

    Attributes:
        name: what it is.
        lengths: cells along its back, least and most.
        depth: cells.
        free_standing: it stands away from all walls; else its whole back is at one.
        chance: that a room has it.
    """

    name: str
    lengths: tuple[int, int]
    depth: int
    free_standing: bool = False
    chance: float = 1.0


NEEDED: dict[str, tuple[Furniture, ...]] = {
    "bathroom": (
        Furniture("bath", (3, 4), 2, chance=0.6),
        Furniture("shower", (2, 2), 2, chance=0.5),
        Furniture("toilet", (1, 1), 1),
        Furniture("basin", (1, 2), 1),
    ),
    "kitchen": (
        Furniture("counter", (4, 7), 1),
        Furniture("counter", (2, 4), 1, chance=0.7),
        Furniture("table", (2, 3), 2, free_standing=True, chance=0.45),
        Furniture("island", (3, 4), 1, free_standing=True, chance=0.45),
        Furniture("fridge", (1, 2), 1),
    ),
    "bedroom": (
        Furniture("double bed", (3, 4), 4, chance=0.75),
        Furniture("single bed", (2, 2), 4, chance=0.35),
        Furniture("wardrobe", (3, 4), 1),
        Furniture("desk", (2, 3), 1, chance=0.6),
        Furniture("chest", (2, 2), 1, chance=0.6),
        Furniture("bedside table", (1, 1), 1, chance=0.5),
    ),
    "living room": (
        Furniture("sofa", (4, 5), 2),
        Furniture("television", (3, 4), 1),
        Furniture("coffee table", (2, 3), 1, free_standing=True, chance=0.6),
        Furniture("dining table", (3, 4), 2, free_standing=True, chance=0.7),
        Furniture("bookcase", (2, 4), 1),
        Furniture("armchair", (2, 2), 2, chance=0.5),
    ),
    "corridor": (Furniture("shoe cabinet", (2, 3), 1, chance=0.5),),
}
FURTHER: dict[str, tuple[Furniture, ...]] = {
    "bathroom": (Furniture("cabinet", (1, 2), 1), Furniture("washing machine", (1, 1), 1)),
    "kitchen": (Furniture("sideboard", (2, 4), 1), Furniture("pantry", (1, 3), 1)),
    "bedroom": (
        Furniture("bookcase", (2, 3), 1),
        Furniture("chest", (2, 3), 1),
        Furniture("armchair", (2, 2), 1),
    ),
    "living room": (
        Furniture("bookcase", (2, 4), 1),
        Furniture("sideboard", (3, 4), 1),
        Furniture("sofa", (3, 4), 2),
        Furniture("plant", (1, 1), 1),
        Furniture("side table", (2, 2), 2, free_standing=True),
    ),
    "corridor": (),
}
SHARES = {  # of a room's cells that furniture takes, least and most
    "bathroom": (0.20, 0.36),
    "kitchen": (0.36, 0.56),
    "bedroom": (0.38, 0.56),
    "living room": (0.32, 0.52),
    "corridor": (0.0, 0.2),
}


def furnished(inside: np.ndarray, use: str, kept: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The cells of a room that stay free, (X, Z) bool, all of them connected.

    Args:
        inside: (X, Z) bool, the room's cells.
        use: what it is used as, a key of `NEEDED`.
        kept: (X, Z) bool, cells that must stay free, before doors for example.
        rng: chooses.
    """
    free = inside.copy()
    least, most = SHARES[use]
    wanted = (least + (most - least) * float(rng.random())) * inside.sum()
    pieces = [piece for piece in NEEDED[use] if rng.random() < piece.chance]
    further = FURTHER[use]
    for number in range(MOST_PIECES):
        needed = number < len(pieces)
        if not needed and (not further or inside.sum() - free.sum() >= wanted):
            break
        piece = pieces[number] if needed else further[int(rng.integers(len(further)))]
        set_down = _with_piece(free, inside, piece, kept, rng)
        free = free if set_down is None else set_down
    return free


def _with_piece(
    free: np.ndarray, inside: np.ndarray, piece: Furniture, kept: np.ndarray, rng: np.random.Generator
) -> np.ndarray | None:
    """The free cells once a piece is set down; None where a place was not found."""
    length = int(rng.integers(piece.lengths[0], piece.lengths[1] + 1))
    places = _places(free & ~kept, inside, length, piece)
    most_dead_ends = int(dead_ends(free).sum()) + int(rng.random() < DEAD_END_CHANCE)
    for index in rng.permutation(len(places))[:TRIES]:
        x0, z0, x1, z1 = places[index]
        left = free.copy()
        left[x0:x1, z0:z1] = False
        if left.any() and is_connected(left) and int(dead_ends(left).sum()) <= most_dead_ends:
            return left
    return None


def _places(usable: np.ndarray, inside: np.ndarray, length: int, piece: Furniture) -> list[tuple[int, int, int, int]]:
    """Boxes of cells (half-open) where a piece may stand, whatever is cut off by it; in a fixed order."""
    depth = piece.depth
    if piece.free_standing:
        roomy = ndimage.minimum_filter(usable, size=3, mode="constant", cval=False)
        return _boxes(_all_in(roomy, length, depth), length, depth) + _boxes(
            _all_in(roomy, depth, length), depth, length
        )
    beyond = ~np.pad(inside, 1)
    along_x, along_z = _all_in(usable, length, depth), _all_in(usable, depth, length)
    low_z, high_z = _all_in(beyond[1:-1, :-2], length, 1), _all_in(beyond[1:-1, 2:], length, 1)
    low_x, high_x = _all_in(beyond[:-2, 1:-1], 1, length), _all_in(beyond[2:, 1:-1], 1, length)
    last_x, last_z = along_z.shape[0], along_x.shape[1]
    backed_x = along_x & (low_z[:, :last_z] | high_z[:, depth - 1 :][:, :last_z])
    backed_z = along_z & (low_x[:last_x] | high_x[depth - 1 :][:last_x])
    return _boxes(backed_x, length, depth) + _boxes(backed_z, depth, length)


def _all_in(marked: np.ndarray, width: int, depth: int) -> np.ndarray:
    """Whether the box of that size from each cell on is marked throughout, bool; empty where none fits."""
    if width > marked.shape[0] or depth > marked.shape[1]:
        return np.zeros((max(0, marked.shape[0] - width + 1), max(0, marked.shape[1] - depth + 1)), bool)
    windows = np.lib.stride_tricks.sliding_window_view(marked, (width, depth))
    return np.asarray(windows.all(axis=(2, 3)))


def _boxes(corners: np.ndarray, width: int, depth: int) -> list[tuple[int, int, int, int]]:
    """Boxes of that size at the marked first cells."""
    return [(x, z, x + width, z + depth) for x, z in np.argwhere(corners).tolist()]


def is_connected(free: np.ndarray) -> bool:
    """Whether the free cells, (X, Z) bool, are one connected part."""
    _, count = ndimage.label(free)
    return bool(count == 1)


def dead_ends(free: np.ndarray) -> np.ndarray:
    """The free cells with at most one free neighbour, (X, Z) bool."""
    around = np.pad(free, 1).astype(int)
    neighbours = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
    return free & (neighbours <= 1)
