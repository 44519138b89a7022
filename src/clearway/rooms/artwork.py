"""Pictures that hang or stand in a room, as pure functions: window views, paintings, books, clocks, rugs, screens.

Every function gives a (height, width, 3) float64 picture in [0, 1], row 0 at the top. With a `step` it gives every so
many-th pixel of that picture, as those of `textures` do.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from clearway.rooms.textures import Colour, mix, noise, stepped


def outdoor(rng: np.random.Generator, height: int = 256, width: int = 256, step: int = 1) -> np.ndarray:
    """The view through a window: sky and clouds, a line of trees or roofs, a lawn."""
    y = _downwards(height, width, step)
    sky = mix((0.45, 0.66, 0.92), (0.86, 0.92, 0.97), np.clip(y / 0.6, 0, 1))
    clouds = np.clip((noise(rng, height, width, 1.6, stretch_y=2, step=step) - 0.52) * 5, 0, 1) * 0.8
    view = mix(sky, (0.98, 0.98, 0.98), clouds)
    hills = 0.5 + 0.12 * (noise(rng, 1, width, 1.9, step=step)[0] - 0.5) * 2
    far = mix((0.35, 0.48, 0.5), (0.45, 0.57, 0.55), noise(rng, height, width, 1.0, step=step))
    view = np.where((y > hills[None])[..., None], far, view)
    if rng.random() < 0.45:
        view = _roofs(rng, view)
    trees = 0.55 + 0.22 * (noise(rng, 1, width, 1.1, step=step)[0] - 0.5) * 2
    leaves = mix((0.08, 0.16, 0.07), (0.26, 0.4, 0.17), noise(rng, height, width, 0.7, step=step))
    view = np.where((y > trees[None])[..., None], leaves, view)
    lawn_top = 0.66 + 0.05 * (noise(rng, 1, width, 1.5, step=step)[0] - 0.5)
    lawn = mix((0.24, 0.36, 0.14), (0.46, 0.57, 0.28), noise(rng, height, width, 0.9, step=step))
    return np.clip(np.where((y > lawn_top[None])[..., None], lawn, view), 0, 1)


def _downwards(height: int, width: int, step: int) -> np.ndarray:
    """How far down each pixel lies, 0 to 1."""
    return np.repeat(np.linspace(0, 1, height)[::step, None], stepped(width, step), axis=1)


def _roofs(rng: np.random.Generator, view: np.ndarray) -> np.ndarray:
    """A few houses with gables in front of the hills."""
    height, width = view.shape[:2]
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    out = view.copy()
    for _ in range(3):
        middle, half, eaves = rng.random(), 0.1 + 0.08 * rng.random(), 0.46 + 0.06 * rng.random()
        wall = (np.abs(x - middle) < half) & (y > eaves)
        roof = (np.abs(x - middle) < half * 1.15) & (y <= eaves) & (y > eaves - 0.14 * (1 - np.abs(x - middle) / half))
        out[wall] = np.array([0.85, 0.8, 0.72]) * (0.8 + 0.2 * rng.random())
        out[roof] = np.array([0.6, 0.3, 0.22]) * (0.7 + 0.5 * rng.random())
        pane = wall & (np.abs((x - middle) / half * 2 % 1 - 0.5) < 0.2) & (np.abs((y - eaves) * 12 % 1 - 0.5) < 0.25)
        out[pane] = (0.3, 0.36, 0.42)
    return out


def painting(rng: np.random.Generator, height: int, width: int, step: int = 1) -> np.ndarray:
    """A landscape, circles, colour blocks, a cloud of colour, a vase or a sail, on a white mount."""
    kinds = (_landscape, _circles, _blocks, _clouds, _vase, _sail)
    picture = np.clip(kinds[int(rng.integers(len(kinds)))](rng, height, width, step), 0, 1)
    border = round(0.08 * min(width, height) / step)
    mount = np.full(picture.shape, 0.94)
    mount[border:-border, border:-border] = picture[border:-border, border:-border]
    return mount


def _landscape(rng: np.random.Generator, height: int, width: int, step: int) -> np.ndarray:
    y = _downwards(height, width, step)
    warm = np.array([0.95, 0.75, 0.5]) + rng.normal(0, 0.05, 3)
    out = mix(warm, (0.5, 0.65, 0.85), 1 - y)
    for layer in range(5):
        ridge = 0.4 + 0.12 * layer + 0.25 * (noise(rng, 1, width, 1.6, step=step)[0] - 0.5)
        colour = np.array([0.25, 0.35, 0.4]) * (1 - 0.13 * layer) + rng.random(3) * 0.18
        out = np.where((y > ridge[None])[..., None], colour, out)
    return out


def _circles(rng: np.random.Generator, height: int, width: int, step: int) -> np.ndarray:
    y, x = np.mgrid[:height:step, :width:step] / height
    out = np.ones((*y.shape, 3)) * (rng.random(3) * 0.3 + 0.65)
    for _ in range(9):
        centre, radius = rng.random(2) * [width / height, 1], 0.06 + 0.2 * rng.random()
        inside = np.hypot(x - centre[0], y - centre[1]) < radius
        out[inside] = 0.35 * out[inside] + 0.65 * rng.random(3)
    return out


def _blocks(rng: np.random.Generator, height: int, width: int, step: int) -> np.ndarray:
    y, x = np.mgrid[:height:step, :width:step] / np.array([height, width])[:, None, None]
    out = np.ones((*y.shape, 3)) * 0.92
    colours = ((0.85, 0.2, 0.15), (0.1, 0.2, 0.5), (0.95, 0.8, 0.2), (0.95, 0.95, 0.92), (0.12, 0.12, 0.12))
    for _ in range(12):
        (left, top), (w, h) = rng.random(2) * 0.8, 0.1 + rng.random(2) * 0.4
        out[(x > left) & (x < left + w) & (y > top) & (y < top + h)] = colours[int(rng.integers(5))]
    return out


def _clouds(rng: np.random.Generator, height: int, width: int, step: int) -> np.ndarray:
    flow = mix(rng.random(3), rng.random(3), np.clip((noise(rng, height, width, 1.5, step=step) - 0.3) * 2, 0, 1))
    return 0.7 * flow + 0.3 * mix(rng.random(3), (1, 1, 1), noise(rng, height, width, 1.5, step=step))


def _vase(rng: np.random.Generator, height: int, width: int, step: int) -> np.ndarray:
    y, x = np.mgrid[:height:step, :width:step] / height
    x = x - width / height / 2
    out = mix(rng.random(3) * 0.2 + 0.72, rng.random(3) * 0.2 + 0.6, (y > 0.78).astype(float))
    body = np.abs(x) < 0.05 + 0.08 * np.sin(np.clip((y - 0.5) / 0.36, 0, 1) * np.pi)
    out[body & (y > 0.5) & (y < 0.86)] = rng.random(3) * 0.5 + 0.1
    for _ in range(14):
        angle, reach = rng.uniform(-0.9, 0.9), rng.uniform(0.12, 0.32)
        tip = np.array([np.sin(angle) * reach, 0.5 - np.cos(angle) * reach])
        stem = np.abs(x * np.cos(angle) + (y - 0.5) * np.sin(angle)) < 0.005
        out[stem & (y < 0.5) & (np.hypot(x, y - 0.5) < reach)] = (0.2, 0.35, 0.15)
        out[np.hypot(x - tip[0], y - tip[1]) < rng.uniform(0.02, 0.05)] = rng.random(3) * 0.6 + 0.35
    return out


def _sail(rng: np.random.Generator, height: int, width: int, step: int) -> np.ndarray:
    y, x = np.mgrid[:height:step, :width:step] / height
    sea = mix((0.1, 0.3, 0.45), (0.3, 0.55, 0.62), noise(rng, height, width, 0.9, stretch_y=4, step=step))
    out = np.where((y > 0.6)[..., None], sea, mix((0.97, 0.85, 0.7), (0.6, 0.78, 0.9), 1 - y))
    for _ in range(int(rng.integers(1, 4))):
        middle, foot, tall = rng.uniform(0.2, 0.8) * width / height, rng.uniform(0.62, 0.75), rng.uniform(0.2, 0.4)
        sail = (x > middle) & (x - middle < (y - foot + tall) * 0.5) & (y < foot - 0.02)
        out[sail] = rng.choice([0.75, 0.85, 0.95]) * np.array([1, 0.98, 0.92])
        out[(np.abs(x - middle) < 0.12 - (y - foot)) & (y > foot - 0.01) & (y < foot + 0.04)] = (0.35, 0.16, 0.1)
    return out


def books(rng: np.random.Generator, height: int = 128, width: int = 384) -> np.ndarray:
    """A row of book spines over a dark gap."""
    out = np.full((height, width, 3), 0.1)
    x = 0
    while x < width - 5:
        thickness = int(rng.integers(7, 20))
        x_end = min(x + thickness, width)
        top = height - int(height * rng.uniform(0.66, 0.96))
        colour = rng.random(3) * rng.choice([0.45, 0.7, 0.9])
        colour = 0.7 * colour + 0.3 * colour.mean() + 0.07
        roundness = 1 - 0.35 * np.linspace(-1, 1, x_end - x) ** 2
        out[top:, x:x_end] = colour * roundness[None, :, None]
        if rng.random() < 0.7:
            band = top + int(rng.uniform(0.1, 0.3) * (height - top))
            out[band : band + 5, x + 1 : x_end - 1] = np.clip(colour + 0.35, 0, 1)
        x = x_end + (1 if rng.random() < 0.92 else int(rng.integers(4, 16)))
    return out


def clock(rng: np.random.Generator, size: int = 192) -> np.ndarray:
    """A clock face that shows some hour."""
    y, x = np.mgrid[:size, :size] / size * 2 - 1
    radius, angle = np.hypot(x, y), np.arctan2(x, -y)
    out = np.full((size, size, 3), 0.95)
    hour = np.abs((angle / (2 * np.pi) * 12 + 0.5) % 1 - 0.5)
    out[(radius > 0.76) & (radius < 0.92) & (hour < 0.06)] = 0.1
    for reach, thickness in ((0.5, 0.05), (0.75, 0.03)):
        hand = rng.uniform(0, 2 * np.pi)
        off = x * np.cos(hand) + y * np.sin(hand)
        ahead = x * np.sin(hand) - y * np.cos(hand)
        out[(np.abs(off) < thickness) & (ahead > -0.1) & (ahead < reach)] = 0.08
    return out


def screen(rng: np.random.Generator, height: int = 144, width: int = 256) -> np.ndarray:
    """A switched-off screen with a soft reflection."""
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    glow = np.exp(-(((x - rng.uniform(0.2, 0.8)) / 0.35) ** 2 + ((y - 0.1) / 0.5) ** 2))
    return np.clip(np.array([0.08, 0.09, 0.105]) + 0.22 * glow[..., None], 0, 1)


RUGS = ("lattice", "stripes", "medallion", "chevrons")
"""Patterns of `rug`."""


def rug(
    rng: np.random.Generator, height: int, width: int, colour: Colour, second: Colour, pattern: str, step: int = 1
) -> np.ndarray:
    """A woven rug with a border; `pattern` is one of RUGS. The pattern is as large along both axes."""
    y, x = np.mgrid[:height:step, :width:step] / min(height, width)
    h, w = height / min(height, width), width / min(height, width)
    edge = np.minimum(np.minimum(x, w - x), np.minimum(y, h - y))
    share = _weave(x - w / 2, y - h / 2, pattern)
    share = np.where(edge < 0.1, 1.0, share)
    share = np.where((edge > 0.03) & (edge < 0.05), 0.0, share)
    wool = 1 + (noise(rng, height, width, 0.3, step=step) - 0.5)[..., None] * 0.4
    return np.clip(mix(colour, second, ndimage.gaussian_filter(share, 0.6 / step)) * wool, 0, 1)


def _weave(x: np.ndarray, y: np.ndarray, pattern: str) -> np.ndarray:
    """Where the second colour of a rug lies, 0 to 1."""
    if pattern == "lattice":
        return (np.abs(x * 6 % 1 - 0.5) + np.abs(y * 6 % 1 - 0.5) < 0.33) * 0.7
    if pattern == "stripes":
        return (x * 6 % 1 < 0.3) * 0.8 + (x * 18 % 1 < 0.2) * 0.15
    if pattern == "chevrons":
        return ((x * 5 + np.abs(y * 5 % 1 - 0.5) * 1.4) % 1 < 0.45) * 0.75
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    petals = (radius * 7 + 0.35 * np.cos(8 * angle)) % 1 < 0.4
    return np.where(radius < 0.36, petals * 0.85, (np.abs(x * 8 % 1 - 0.5) < 0.06) * 0.4)
