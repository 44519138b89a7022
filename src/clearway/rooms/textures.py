"""Textures of surfaces, as pure functions of a random generator: wood, tiles, cloth, plaster, paper, stone.

Every function gives a tileable (height, width, 3) float64 picture in [0, 1], row 0 at the top. With a `step` it gives
every so many-th pixel of that picture, across and down, at the cost of those: height and width are those of the whole
picture, and the generator's draws too. Noise too fine for it is left out, and lines are as dark as a mean makes them.
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
    step: int = 1,
) -> np.ndarray:
    """Tileable 1/f^exponent noise, (height, width) in [0, 1] with mean 0.5.

    A stretch above 1 makes the pattern finer along that axis' frequencies, so streaks run along the other one.
    """
    rows, columns = stepped(height, step), stepped(width, step)
    phases = rng.random((height, width // 2 + 1))
    if step > 1:
        phases = phases[np.fft.fftfreq(rows, 1 / rows).astype(int), : columns // 2 + 1]
    spectrum = _amplitude(rows, columns, exponent, stretch_x, stretch_y) * np.exp(2j * np.pi * phases)
    field = np.fft.irfft2(spectrum, s=(rows, columns))
    field -= field.mean()
    field /= np.hypot(field.std(), _left_out(height, width, exponent, stretch_x, stretch_y, step)) + 1e-9
    return np.clip(field / 5 + 0.5, 0, 1)


def stepped(length: int, step: int) -> int:
    """How many of so many pixels every `step`-th one is."""
    return -(-length // step)


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


@lru_cache(maxsize=64)
def _left_out(height: int, width: int, exponent: float, stretch_x: float, stretch_y: float, step: int) -> float:
    """Deviation that the frequencies too fine for `step` would add to the field, before it is scaled."""
    rows, columns = stepped(height, step), stepped(width, step)
    if (rows, columns) == (height, width):
        return 0.0
    fy = np.arange(height // 2 + 1, dtype=np.float32)[:, None] * np.float32(stretch_y)
    fx = np.arange(width // 2 + 1, dtype=np.float32) * np.float32(stretch_x)
    power = (np.maximum(fy**2 + fx**2, 1)) ** np.float32(-exponent)
    power[: rows // 2 + 1, : columns // 2 + 1] = 0
    power[1:] *= 2  # frequencies below zero, alike
    along_x = power.sum(axis=0, dtype=np.float64)
    return float(np.sqrt(along_x[0] / 2 + 2 * along_x[1:].sum())) / (rows * columns)  # of column 0 half is lost


def stepped_mean(row: np.ndarray, step: int) -> np.ndarray:
    """The mean of every `step` values of a row, (N / step rounded up,)."""
    firsts = np.arange(0, len(row), step)
    return np.add.reduceat(row.astype(float), firsts) / np.diff(firsts, append=len(row))


def mix(low: np.ndarray | Colour, high: np.ndarray | Colour, share: np.ndarray) -> np.ndarray:
    """Colours between `low` and `high`, (..., 3), by `share` (...)."""
    return np.asarray(low) * (1 - share[..., None]) + np.asarray(high) * share[..., None]


def wood(
    rng: np.random.Generator, height: int, width: int, dark: Colour, light: Colour, rings: float = 6, step: int = 1
) -> np.ndarray:
    """Boards of one piece; the grain runs along the width."""
    broad = noise(rng, height, width, 1.7, stretch_x=6, step=step)
    fine = noise(rng, height, width, 0.7, stretch_x=24, step=step)
    across = np.linspace(0, 1, height, endpoint=False)[::step, None]
    ring = 0.5 + 0.5 * np.sin(2 * np.pi * (round(rings) * across + 2.2 * broad))
    return mix(dark, light, np.clip(0.33 * ring + 0.35 * broad + 0.35 * (fine - 0.5) + 0.1, 0, 1))


def planks(
    rng: np.random.Generator, height: int, width: int, rows: int, dark: Colour, light: Colour, step: int = 1
) -> np.ndarray:
    """A plank floor; `rows` planks across the height, butted at random places along the width."""
    edges = np.linspace(0, height, rows + 1).round().astype(int)
    out = np.empty((stepped(height, step), stepped(width, step), 3))
    for top, bottom in itertools.pairwise(edges):
        lines = slice(stepped(top, step), stepped(bottom, step))
        out[lines] = _plank_row(rng, bottom - top, width, dark, light, step)[: lines.stop - lines.start]
        out[lines.start] *= _seam(0.55, step)
    return np.clip(out, 0, 1)


def _plank_row(rng: np.random.Generator, height: int, width: int, dark: Colour, light: Colour, step: int) -> np.ndarray:
    """One row of planks that closes on itself."""
    count = max(2, round(width / (height * 9)))
    start = int(rng.integers(width))
    cuts = (start + np.arange(count) * width // count + rng.integers(0, width // (3 * count), count)) % width
    row = np.empty((stepped(height, step), stepped(width, step), 3))
    for first, last in zip(cuts, np.roll(cuts, -1), strict=True):
        columns = np.arange(first, last if last > first else last + width) % width
        board = wood(rng, height, len(columns), dark, light, 1, step) * (0.82 + 0.36 * rng.random())
        places = columns[columns % step == 0] // step
        row[:, places] = board[:, : len(places)] + (rng.random(3) - 0.5) * 0.03
        row[:, places[0]] *= _seam(0.55, step)
    return row


def _seam(brightness: float, step: int) -> float:
    """Brightness of the mean of so many pixels, one of which is a dark seam."""
    return brightness if step == 1 else 1 - (1 - brightness) / step


def parquet(
    rng: np.random.Generator, height: int, width: int, blocks: int, dark: Colour, light: Colour, step: int = 1
) -> np.ndarray:
    """Square parquet: `blocks` x `blocks` squares of five staves whose direction alternates."""
    out = np.empty((stepped(height, step), stepped(width, step), 3))
    edges_y = np.linspace(0, height, blocks + 1).round().astype(int)
    edges_x = np.linspace(0, width, blocks + 1).round().astype(int)
    for i in range(blocks):
        for j in range(blocks):
            h, w = edges_y[i + 1] - edges_y[i], edges_x[j + 1] - edges_x[j]
            square = _staves(rng, h, w, dark, light, step)
            if (i + j) % 2:
                square = _staves(rng, w, h, dark, light, step).swapaxes(0, 1)
            place = out[
                stepped(edges_y[i], step) : stepped(edges_y[i + 1], step),
                stepped(edges_x[j], step) : stepped(edges_x[j + 1], step),
            ]
            place[:] = square[: place.shape[0], : place.shape[1]]
    return np.clip(out, 0, 1)


def _staves(rng: np.random.Generator, height: int, width: int, dark: Colour, light: Colour, step: int) -> np.ndarray:
    """Five staves on top of one another."""
    edges = np.linspace(0, height, 6).round().astype(int)
    out = np.empty((stepped(height, step), stepped(width, step), 3))
    for top, bottom in itertools.pairwise(edges):
        stave = wood(rng, bottom - top, width, dark, light, 1, step) * (0.86 + 0.28 * rng.random())
        lines = slice(stepped(top, step), stepped(bottom, step))
        out[lines] = stave[: lines.stop - lines.start]
        out[lines.start] *= _seam(0.75, step)
    out[:, 0] *= _seam(0.75, step)
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
    step: int = 1,
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
        step: as above.
    """
    clouds = noise(rng, height, width, 1.6, step=step)
    veins = np.exp(-(((noise(rng, height, width, 1.3, step=step) - 0.5) * 2 / 0.06) ** 2))
    y, x = np.mgrid[:height:step, :width:step]
    row = y * rows // height
    shifted = (x + (row % 2) * (width // columns // 2 if bonded else 0)) % width
    column = shifted * columns // width
    aside = [stepped_mean(_on_line(width, columns, grout_px, start), step) for start in (0, width // columns // 2)]
    across = np.array(aside)[row[:, 0] % 2 if bonded else 0]
    joint = 1 - (1 - stepped_mean(_on_line(height, rows, grout_px), step))[:, None] * (1 - across)
    base = np.ones((*y.shape, 3)) * np.array(colour)
    if second is not None:
        base = np.where(((row + column) % 2 == 1)[..., None], np.array(second), base)
    base *= 1 + (clouds - 0.5)[..., None] * marble * 2
    base -= veins[..., None] * marble * 0.35
    base *= (1 + (rng.random((rows, columns)) - 0.5) * 2 * variety)[row, column][..., None]
    from_line = np.minimum(y - row * height // rows, shifted - column * width // columns)
    base[(from_line >= grout_px) & (from_line < grout_px + 2)] *= 1.04
    line = joint > 0
    base[line] = mix(base[line], np.array(grout) * (1 + (clouds[line] - 0.5)[:, None] * 0.2), joint[line])
    return np.clip(base, 0, 1)


def _on_line(length: int, count: int, breadth: int, start: int = 0) -> np.ndarray:
    """Which pixels of a row of `count` tiles, the first one cut at `start`, are grout, (length,) bool."""
    place = (np.arange(length) + start) % length
    return place - place * count // length * length // count < breadth


def fabric(
    rng: np.random.Generator, height: int, width: int, colour: Colour, strength: float = 0.16, step: int = 1
) -> np.ndarray:
    """A woven cloth; the weave is too fine for a step above 1."""
    grain = noise(rng, height, width, 0.4, step=step) - 0.5
    wear = noise(rng, height, width, 1.4, step=step) - 0.5
    y, x = np.mgrid[:height, :width] if step == 1 else (0, 0)
    weave = 0.25 * np.sin(2 * np.pi * x / 4) + 0.25 * np.sin(2 * np.pi * y / 4)
    return np.clip(np.array(colour) * (1 + strength * (weave + 1.2 * grain + wear)[..., None]), 0, 1)


def striped(
    rng: np.random.Generator, height: int, width: int, colour: Colour, second: Colour, stripes: int = 6, step: int = 1
) -> np.ndarray:
    """A cloth with upright stripes, every third of them narrow."""
    phase = (np.arange(0, width, step) * stripes / width) % 1
    share = ((phase < 0.4) | ((phase > 0.62) & (phase < 0.7))).astype(float)
    cloth = fabric(rng, height, width, (1, 1, 1), 0.1, step)
    return np.clip(mix(colour, second, np.tile(share, (len(cloth), 1))) * cloth, 0, 1)


def pile(
    rng: np.random.Generator, height: int, width: int, colour: Colour, second: Colour, step: int = 1
) -> np.ndarray:
    """A cut-pile carpet that mixes two colours."""
    tufts = noise(rng, height, width, 0.25, step=step) - 0.5
    share = np.clip(noise(rng, height, width, 1.2, step=step), 0, 1)
    return np.clip(mix(colour, second, share) * (1 + 0.5 * tufts[..., None]), 0, 1)


def plaster(
    rng: np.random.Generator, height: int, width: int, colour: Colour, strength: float = 0.05, step: int = 1
) -> np.ndarray:
    """Painted plaster: almost one colour."""
    clouds = noise(rng, height, width, 1.2, step=step) - 0.5
    grain = noise(rng, height, width, 0.2, step=step) - 0.5
    return np.clip(np.array(colour) * (1 + strength * (clouds + 0.6 * grain)[..., None]), 0, 1)


WALLPAPERS = ("stripes", "damask", "trellis", "leaves", "dots")
"""Patterns of `wallpaper`."""


def wallpaper(
    rng: np.random.Generator,
    height: int,
    width: int,
    colour: Colour,
    second: Colour,
    pattern: str,
    repeats: int,
    step: int = 1,
) -> np.ndarray:
    """Printed paper; `pattern` is one of WALLPAPERS and repeats that many times across the width and height."""
    share = _printed(height, width, pattern, repeats, step)
    return np.clip(mix(colour, second, share) * (0.98 + 0.04 * noise(rng, height, width, step=step)[..., None]), 0, 1)


@lru_cache(maxsize=32)
def _printed(height: int, width: int, pattern: str, repeats: int, step: int) -> np.ndarray:
    """Where a wallpaper's second colour is printed, 0 to 1, a little blurred."""
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    share = ndimage.gaussian_filter(_print(x * repeats, y * repeats, pattern), 0.8, mode="wrap")
    if step > 1:
        share = ndimage.uniform_filter(share, step, mode="wrap", origin=-(step // 2))[::step, ::step]
    share.setflags(write=False)
    return share


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


def stone(
    rng: np.random.Generator, height: int, width: int, colour: Colour, speckle: float = 0.5, step: int = 1
) -> np.ndarray:
    """Speckled granite or terrazzo."""
    fine = noise(rng, height, width, 0.25, step=step) - 0.5
    coarse = noise(rng, height, width, 0.9, step=step) - 0.5
    return np.clip(np.array(colour) * (1 + speckle * (fine + coarse)[..., None]), 0, 1)


def brushed(rng: np.random.Generator, height: int, width: int, colour: Colour, step: int = 1) -> np.ndarray:
    """Brushed metal."""
    streaks = noise(rng, height, width, 0.4, stretch_x=40, step=step) - 0.5
    return np.clip(np.array(colour) * (1 + 0.14 * streaks[..., None]), 0, 1)


def wicker(
    rng: np.random.Generator, height: int, width: int, colour: Colour, strands: int = 12, step: int = 1
) -> np.ndarray:
    """A basket weave of `strands` x `strands` strands."""
    y, x = np.mgrid[:height:step, :width:step] / np.array([height, width])[:, None, None] * strands
    over = (np.floor(x / 2) + np.floor(y)) % 2
    round_x, round_y = np.sin(np.pi * (x / 2 % 1)), np.sin(np.pi * (y % 1))
    shade = np.where(over > 0, round_x * 0.5 + 0.5, 0.7) * (0.55 + 0.45 * round_y)
    return np.clip(np.array(colour) * (0.45 + 0.7 * shade)[..., None] * (0.8 + 0.4 * rng.random()), 0, 1)
