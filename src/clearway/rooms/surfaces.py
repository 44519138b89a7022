"""The flat surfaces of a room (floor, ceiling, walls, partitions) and the pictures painted on them before the light."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from clearway.rooms.textures import stepped

PIXELS_PER_METRE = 160
"""Resolution of floors and walls; their textures are made at this scale."""


@dataclass(eq=False)
class Surface:
    """One rectangle of the shell, seen from inside the room.

    Attributes:
        name: unique in the room, for example "floor" or "wall south".
        origin_m: (3,) its lower left corner.
        right_m, up_m: (3,) its sides; right x up points into the room.
        albedo: (height, width, 3) picture at PIXELS_PER_METRE, or fewer, in [0, 1], row 0 at the bottom.
        group: MuJoCo's geom group.
    """

    name: str
    origin_m: np.ndarray
    right_m: np.ndarray
    up_m: np.ndarray
    albedo: np.ndarray = field(repr=False)
    group: int = 2

    @property
    def width_m(self) -> float:
        """Length of the horizontal side (floor and ceiling: along x)."""
        return float(np.linalg.norm(self.right_m))

    @property
    def height_m(self) -> float:
        """Length of the other side."""
        return float(np.linalg.norm(self.up_m))

    @property
    def normal(self) -> np.ndarray:
        """(3,) unit vector into the room."""
        normal = np.cross(self.right_m, self.up_m)
        return normal / np.linalg.norm(normal)


def pixels(length_m: float, step: int = 1) -> int:
    """Pixels of a length on a surface; with a `step`, of a picture that has only every so many-th (`textures`)."""
    return stepped(max(1, round(length_m * PIXELS_PER_METRE)), step)


def tiled(image: np.ndarray, width_m: float, height_m: float, step: int = 1) -> np.ndarray:
    """A tileable texture repeated over a surface; its first row lies at the bottom of the surface."""
    covered = np.empty((pixels(height_m, step), pixels(width_m, step), 3))
    rows, columns = image.shape[:2]
    for bottom in range(0, len(covered), rows):
        for left in range(0, covered.shape[1], columns):
            place = covered[bottom : bottom + rows, left : left + columns]
            place[:] = image[::-1][: place.shape[0], : place.shape[1]]
    return covered


def with_band(
    below: np.ndarray, above: np.ndarray, height_m: float, rail: np.ndarray | None = None, step: int = 1
) -> np.ndarray:
    """A wall with one picture up to `height_m` and another above it, and a painted rail of 4 cm between them.

    Args:
        below: (height, width, 3) picture of the lower part, as large as `above`.
        above: picture of the upper part.
        height_m: where they meet.
        rail: (3,) colour of the rail, or None for none.
        step: as of `pixels`.
    """
    wall, edge, breadth = above.copy(), pixels(height_m, step), pixels(0.04, step)
    wall[:edge] = below[:edge]
    if rail is not None:
        shade = np.linspace(0.8, 1.05, breadth)[:, None, None]
        wall[edge : edge + breadth] = np.clip(np.asarray(rail) * shade, 0, 1)
    return wall


def pasted(
    albedo: np.ndarray, image: np.ndarray, centre_m: tuple[float, float], round_edge: bool = False, step: int = 1
) -> np.ndarray:
    """The surface with a picture laid on it (a rug, splash tiles), cut at the borders of the surface.

    Args:
        albedo: (height, width, 3) picture of the surface, row 0 at the bottom.
        image: the picture to lay down, with pixels of the same size, row 0 at the top.
        centre_m: its middle, measured from the lower left corner of the surface.
        round_edge: cut the picture to an ellipse.
        step: as of `pixels`.
    """
    image = image[::-1]
    left = pixels(centre_m[0], step) - image.shape[1] // 2
    bottom = pixels(centre_m[1], step) - image.shape[0] // 2
    top, right = min(bottom + image.shape[0], albedo.shape[0]), min(left + image.shape[1], albedo.shape[1])
    cut = image[max(0, -bottom) : top - bottom, max(0, -left) : right - left]
    target = (slice(max(bottom, 0), top), slice(max(left, 0), right))
    out = albedo.copy()
    if round_edge:
        y, x = np.mgrid[: image.shape[0], : image.shape[1]]
        radius = np.hypot((y + 0.5) / image.shape[0] * 2 - 1, (x + 0.5) / image.shape[1] * 2 - 1)
        inside = (radius < 1)[max(0, -bottom) : top - bottom, max(0, -left) : right - left, None]
        out[target] = np.where(inside, cut, out[target])
    else:
        out[target] = cut
    return out
