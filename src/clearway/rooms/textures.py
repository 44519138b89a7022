"""Textures of surfaces, as pure functions of a random generator: wood, tiles, cloth, plaster, paper, stone.

Every function gives a tileable (height, width, 3) float64 picture in [0, 1], row 0 at the top.
"""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np
from scipy import ndimage

Colour = tuple[float, float, float]
"""Red, green, blue in [0, 1]."""


def noise(
    rng: np.random.Generator,
    height: int,
    width: int,
    exponent: float = 1.0,
    stretch_x: float = 1.0,
    stretch_y: float = 1.0,
) -> np.ndarray:
    """Tileable 1/f^exponent noise, (height, width) in [0, 1] with mean 0.5.

    A stretch above 1 makes the pattern finer along that axis' frequencies, so streaks run along the other one.
    """
    amplitude = _amplitude(height, width, exponent, stretch_x, stretch_y)
    spectrum = amplitude * np.exp(2j * np.pi * rng.random(amplitude.shape))
    field = np.fft.irfft2(spectrum, s=(height, width))
    field -= field.mean()
    field /= field.std() + 1e-9
    return np.clip(field / 5 + 0.5, 0, 1)


@lru_cache(maxsize=64)
def _amplitude(height: int, width: int, exponent: float, stretch_x: float, stretch_y: float) -> np.ndarray:
    """Strength of each frequency in `noise`, (height, width // 2 + 1)."""
    fy = np.fft.fftfreq(height)[:, None] * height * stretch_y
    fx = np.fft.rfftfreq(width)[None] * width * stretch_x
    frequency = np.hypot(fx, fy)
    frequency[0, 0] = 1.0
    amplitude = frequency**-exponent
    amplitude[0, 0] = 0.0
    return amplitude


def mix(low: np.ndarray | Colour, high: np.ndarray | Colour, share: np.ndarray) -> np.ndarray:
    """Colours between `low` and `high`, (height, width, 3), by `share` (height, width)."""
    return np.asarray(low) * (1 - share[..., None]) + np.asarray(high) * share[..., None]


def wood(
    rng: np.random.Generator, height: int, width: int, dark: Colour, light: Colour, rings: float = 6
) -> np.ndarray:
    """Boards of one piece; the grain runs along the width."""
    broad = noise(rng, height, width, 1.7, stretch_x=6)
    fine = noise(rng, height, width, 0.7, stretch_x=24)
    across = np.linspace(0, 1, height, endpoint=False)[:, None]
    ring = 0.5 + 0.5 * np.sin(2 * np.pi * (round(rings) * across + 2.2 * broad))
    return mix(dark, light, np.clip(0.33 * ring + 0.35 * broad + 0.35 * (fine - 0.5) + 0.1, 0, 1))


def planks(rng: np.random.Generator, height: int, width: int, rows: int, dark: Colour, light: Colour) -> np.ndarray:
    """A plank floor; `rows` planks across the height, butted at random places along the width."""
    edges = np.linspace(0, height, rows + 1).round().astype(int)
    out = np.empty((height, width, 3))
    for top, bottom in itertools.pairwise(edges):
        out[top:bottom] = _plank_row(rng, bottom - top, width, dark, light)
        out[top] *= 0.55
    return np.clip(out, 0, 1)


def _plank_row(rng: np.random.Generator, height: int, width: int, dark: Colour, light: Colour) -> np.ndarray:
    """One row of planks that closes on itself."""
    count = max(2, round(width / (height * 9)))
    start = int(rng.integers(width))
    cuts = (start + np.arange(count) * width // count + rng.integers(0, width // (3 * count), count)) % width
    row = np.empty((height, width, 3))
    for first, last in zip(cuts, np.roll(cuts, -1), strict=True):
        columns = np.arange(first, last if last > first else last + width) % width
        board = wood(rng, height, len(columns), dark, light, rings=1) * (0.82 + 0.36 * rng.random())
        row[:, columns] = board + (rng.random(3) - 0.5) * 0.03
        row[:, columns[0]] *= 0.55
    return row


def parquet(rng: np.random.Generator, height: int, width: int, blocks: int, dark: Colour, light: Colour) -> np.ndarray:
    """Square parquet: `blocks` x `blocks` squares of five staves whose direction alternates."""
    out = np.empty((height, width, 3))
    edges_y = np.linspace(0, height, blocks + 1).round().astype(int)
    edges_x = np.linspace(0, width, blocks + 1).round().astype(int)
    for i in range(blocks):
        for j in range(blocks):
            h, w = edges_y[i + 1] - edges_y[i], edges_x[j + 1] - edges_x[j]
            square = _staves(rng, h, w, dark, light)
            if (i + j) % 2:
                square = _staves(rng, w, h, dark, light).swapaxes(0, 1)
            out[edges_y[i] : edges_y[i + 1], edges_x[j] : edges_x[j + 1]] = square
    return np.clip(out, 0, 1)


def _staves(rng: np.random.Generator, height: int, width: int, dark: Colour, light: Colour) -> np.ndarray:
    """Five staves on top of one another."""
    edges = np.linspace(0, height, 6).round().astype(int)
    out = np.empty((height, width, 3))
    for top, bottom in itertools.pairwise(edges):
        out[top:bottom] = wood(rng, bottom - top, width, dark, light, rings=1) * (0.86 + 0.28 * rng.random())
        out[top] *= 0.75
    out[:, 0] *= 0.75
    return out


def tiles(
    rng: np.random.Generator,
    height: int,
    width: int,
    columns: int,
    rows: int,
    colour: Colour,
    grout: Colour,
    variety: float = 0.05,
    marble: float = 0.15,
    grout_px: int = 2,
    bonded: bool = False,
    second: Colour | None = None,
) -> np.ndarray:
    """Tiles with grout lines.

    Args:
        rng: source of the pattern.
        height: pixels.
        width: pixels.
        columns: tiles across the width.
        rows: tiles across the height; even where `bonded` or `second` is set.
        colour: of the tiles.
        grout: colour of the lines; they are `grout_px` wide.
        variety: how far single tiles differ in brightness.
        marble: strength of clouds and veins.
        grout_px: width of the lines, pixels; 0 leaves them out.
        bonded: shift every second row by half a tile, like bricks.
        second: colour of every other tile, as on a chessboard.
    """
    clouds = noise(rng, height, width, 1.6)
    veins = np.exp(-(((noise(rng, height, width, 1.3) - 0.5) * 2 / 0.06) ** 2))
    y, x = np.mgrid[:height, :width]
    row = y * rows // height
    shifted = (x + (row % 2) * (width // columns // 2 if bonded else 0)) % width
    column = shifted * columns // width
    base = np.ones((height, width, 3)) * np.array(colour)
    if second is not None:
        base = np.where(((row + column) % 2 == 1)[..., None], np.array(second), base)
    base *= 1 + (clouds - 0.5)[..., None] * marble * 2
    base -= veins[..., None] * marble * 0.35
    base *= (1 + (rng.random((rows, columns)) - 0.5) * 2 * variety)[row, column][..., None]
    from_line = np.minimum(y - row * height // rows, shifted - column * width // columns)
    base[(from_line >= grout_px) & (from_line < grout_px + 2)] *= 1.04
    line = from_line < grout_px
    base[line] = np.array(grout) * (1 + (clouds[line] - 0.5)[:, None] * 0.2)
    return np.clip(base, 0, 1)


def fabric(rng: np.random.Generator, height: int, width: int, colour: Colour, strength: float = 0.16) -> np.ndarray:
    """A woven cloth."""
    y, x = np.mgrid[:height, :width]
    weave = 0.25 * np.sin(2 * np.pi * x / 4) + 0.25 * np.sin(2 * np.pi * y / 4)
    grain = noise(rng, height, width, 0.4) - 0.5
    wear = noise(rng, height, width, 1.4) - 0.5
    return np.clip(np.array(colour) * (1 + strength * (weave + 1.2 * grain + wear)[..., None]), 0, 1)


def striped(
    rng: np.random.Generator, height: int, width: int, colour: Colour, second: Colour, stripes: int = 6
) -> np.ndarray:
    """A cloth with upright stripes, every third of them narrow."""
    phase = (np.arange(width) * stripes / width) % 1
    share = ((phase < 0.4) | ((phase > 0.62) & (phase < 0.7))).astype(float)
    cloth = fabric(rng, height, width, (1, 1, 1), 0.1)
    return np.clip(mix(colour, second, np.tile(share, (height, 1))) * cloth, 0, 1)


def pile(rng: np.random.Generator, height: int, width: int, colour: Colour, second: Colour) -> np.ndarray:
    """A cut-pile carpet that mixes two colours."""
    tufts = noise(rng, height, width, 0.25) - 0.5
    share = np.clip(noise(rng, height, width, 1.2), 0, 1)
    return np.clip(mix(colour, second, share) * (1 + 0.5 * tufts[..., None]), 0, 1)


def plaster(rng: np.random.Generator, height: int, width: int, colour: Colour, strength: float = 0.05) -> np.ndarray:
    """Painted plaster: almost one colour."""
    clouds = noise(rng, height, width, 1.2) - 0.5
    grain = noise(rng, height, width, 0.2) - 0.5
    return np.clip(np.array(colour) * (1 + strength * (clouds + 0.6 * grain)[..., None]), 0, 1)


WALLPAPERS = ("stripes", "damask", "trellis", "leaves", "dots")
"""Patterns of `wallpaper`."""


def wallpaper(
    rng: np.random.Generator, height: int, width: int, colour: Colour, second: Colour, pattern: str, repeats: int
) -> np.ndarray:
    """Printed paper; `pattern` is one of WALLPAPERS and repeats that many times across the width and height."""
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    share = ndimage.gaussian_filter(_print(x * repeats, y * repeats, pattern), 0.8, mode="wrap")
    return np.clip(mix(colour, second, share) * (0.98 + 0.04 * noise(rng, height, width)[..., None]), 0, 1)


def _print(x: np.ndarray, y: np.ndarray, pattern: str) -> np.ndarray:
    """Where the second colour of a wallpaper is printed, 0 to 1; the pattern has period 1 in x and y."""
    u, v = x % 1 - 0.5, y % 1 - 0.5
    if pattern == "stripes":
        return ((u < -0.05) | (np.abs(u - 0.22) < 0.03)).astype(float)
    if pattern == "trellis":
        return (np.abs(np.abs(u) + np.abs(v) - 0.45) < 0.035).astype(float)
    if pattern == "dots":
        shifted = np.minimum(np.hypot(u, v), np.hypot(np.abs(u) - 0.5, np.abs(v) - 0.5))
        return (shifted < 0.12).astype(float)
    v = (y + 0.5 * (np.floor(x * 2) % 2)) % 1 - 0.5
    u = (x * 2) % 1 - 0.5
    angle, radius = np.arctan2(v * 1.4, u), np.hypot(u * 0.7, v)
    if pattern == "damask":
        return (radius < 0.2 + 0.1 * np.cos(4 * angle) + 0.04 * np.cos(8 * angle)).astype(float)
    stem = np.abs(u - 0.12 * np.sin(2 * np.pi * v)) < 0.02
    leaf = np.abs(np.sin(3 * np.pi * v)) * 0.28
    blade = (np.abs(u) < leaf) & (np.abs((np.abs(u) * 0.9 + v * 3) % 1 - 0.5) < 0.2)
    return (stem | blade).astype(float)


def stone(rng: np.random.Generator, height: int, width: int, colour: Colour, speckle: float = 0.5) -> np.ndarray:
    """Speckled granite or terrazzo."""
    fine = noise(rng, height, width, 0.25) - 0.5
    coarse = noise(rng, height, width, 0.9) - 0.5
    return np.clip(np.array(colour) * (1 + speckle * (fine + coarse)[..., None]), 0, 1)


def brushed(rng: np.random.Generator, height: int, width: int, colour: Colour) -> np.ndarray:
    """Brushed metal."""
    streaks = noise(rng, height, width, 0.4, stretch_x=40) - 0.5
    return np.clip(np.array(colour) * (1 + 0.14 * streaks[..., None]), 0, 1)


def wicker(rng: np.random.Generator, height: int, width: int, colour: Colour, strands: int = 12) -> np.ndarray:
    """A basket weave of `strands` x `strands` strands."""
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None] * strands
    over = (np.floor(x / 2) + np.floor(y)) % 2
    round_x, round_y = np.sin(np.pi * (x / 2 % 1)), np.sin(np.pi * (y % 1))
    shade = np.where(over > 0, round_x * 0.5 + 0.5, 0.7) * (0.55 + 0.45 * round_y)
    return np.clip(np.array(colour) * (0.45 + 0.7 * shade)[..., None] * (0.8 + 0.4 * rng.random()), 0, 1)
