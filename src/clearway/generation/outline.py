"""The outline of a room: which cells lie within its walls, furniture included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SHAPES = ("rectangle", "L", "T", "niche", "breast")
SHAPE_SHARES = (0.34, 0.24, 0.14, 0.16, 0.12)
NARROWEST = 3  # cells that a part of a room is wide, at least
SIZES = {  # cells of 0.5 m: least and most of the shorter side, then of the longer
    "bathroom": ((4, 5), (5, 7)),
    "kitchen": ((5, 9), (6, 11)),
    "bedroom": ((5, 8), (6, 9)),
    "living room": ((6, 10), (8, 13)),
}


@dataclass(frozen=True)
class Outline:
    """What a room's walls enclose.

    Attributes:
        width, depth: cells along x and z; the depth is the shorter one.
        shape: one of `SHAPES`: an L lacks a corner, a T two on one side, a niche goes out from a wall, and a breast (of
            a chimney) comes in from one.
    """

    width: int
    depth: int
    shape: str


def draw_outline(use: str, rng: np.random.Generator) -> Outline:
    """The size and shape of a room of some use."""
    shorter, longer = SIZES[use]
    depth = int(rng.integers(shorter[0], shorter[1] + 1))
    width = int(rng.integers(max(depth, longer[0]), longer[1] + 1))
    return Outline(width, depth, SHAPES[drawn(rng, SHAPE_SHARES)])


def inside_of(outline: Outline, rng: np.random.Generator) -> np.ndarray:
    """The cells of a room, (X, Z) bool; a generator chooses where corners are cut, niches go out, breasts come in."""
    inside = np.ones((outline.width, outline.depth), bool)
    most_across, most_along = (max(1, (side - NARROWEST)) for side in inside.shape)
    if outline.shape in ("L", "T"):
        along = int(rng.integers(1, min(most_along, outline.depth // 2) + 1))
        across = int(rng.integers(1, min(most_across, outline.width // 2) + 1))
        inside[:across, :along] = False
        rest = outline.width - across - NARROWEST
        if outline.shape == "T" and rest >= 1:
            second = int(rng.integers(1, min(rest, outline.width // 2) + 1))
            inside[-second:, :along] = False
    elif outline.shape == "niche":
        width = int(rng.integers(2, max(3, outline.width // 2) + 1))
        start = int(rng.integers(0, outline.width - width + 1))
        deep = int(rng.integers(1, 3))
        bay = np.zeros((outline.width, deep), bool)
        bay[start : start + width] = True
        inside = np.concatenate([bay, inside], axis=1)
    elif outline.shape == "breast":
        width = int(rng.integers(1, min(3, outline.width - 3) + 1))
        start = int(rng.integers(1, outline.width - width))
        inside[start : start + width, 0] = False
    return inside


def drawn(rng: np.random.Generator, shares: tuple[float, ...]) -> int:
    """An index, drawn by shares that sum to 1."""
    left = float(rng.random())
    for index, share in enumerate(shares):
        left -= share
        if left < 0:
            return index
    return len(shares) - 1
