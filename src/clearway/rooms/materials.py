"""The colours of a room and how its materials look; each is made the first time a piece of furniture asks for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from clearway.rooms import textures
from clearway.rooms.textures import Colour


@dataclass(frozen=True)
class Colours:
    """A scheme of colours that go together.

    Attributes:
        upholstery: sofas and armchairs.
        accent: cushions, seats, towels.
        second_accent: throws, some vases, second towels.
        curtain: curtains.
        wall: most walls; `feature_wall` one of them.
        cabinet: kitchen fronts and painted furniture.
        dark_wood, light_wood: the two ends of the grain of most furniture.
        rug: ground of the rug; `rug_second` its pattern.
    """

    upholstery: Colour
    accent: Colour
    second_accent: Colour
    curtain: Colour
    wall: Colour
    feature_wall: Colour
    cabinet: Colour
    dark_wood: Colour
    light_wood: Colour
    rug: Colour
    rug_second: Colour


SCHEMES = (
    Colours(
        upholstery=(0.47, 0.36, 0.28), accent=(0.13, 0.55, 0.58), second_accent=(0.86, 0.62, 0.22),
        curtain=(0.55, 0.22, 0.2), wall=(0.84, 0.79, 0.7), feature_wall=(0.5, 0.6, 0.58),
        cabinet=(0.23, 0.34, 0.5), dark_wood=(0.4, 0.25, 0.14), light_wood=(0.64, 0.44, 0.26),
        rug=(0.62, 0.25, 0.2), rug_second=(0.87, 0.78, 0.6),
    ),
    Colours(
        upholstery=(0.42, 0.46, 0.52), accent=(0.85, 0.52, 0.2), second_accent=(0.2, 0.36, 0.5),
        curtain=(0.32, 0.4, 0.54), wall=(0.76, 0.8, 0.83), feature_wall=(0.38, 0.47, 0.58),
        cabinet=(0.86, 0.86, 0.83), dark_wood=(0.5, 0.36, 0.22), light_wood=(0.76, 0.6, 0.42),
        rug=(0.27, 0.35, 0.48), rug_second=(0.85, 0.82, 0.75),
    ),
    Colours(
        upholstery=(0.36, 0.44, 0.33), accent=(0.88, 0.74, 0.34), second_accent=(0.7, 0.36, 0.26),
        curtain=(0.8, 0.72, 0.55), wall=(0.86, 0.84, 0.75), feature_wall=(0.52, 0.58, 0.44),
        cabinet=(0.46, 0.55, 0.45), dark_wood=(0.36, 0.23, 0.15), light_wood=(0.56, 0.39, 0.25),
        rug=(0.78, 0.7, 0.55), rug_second=(0.34, 0.42, 0.3),
    ),
    Colours(
        upholstery=(0.62, 0.57, 0.5), accent=(0.7, 0.28, 0.3), second_accent=(0.3, 0.42, 0.45),
        curtain=(0.45, 0.48, 0.44), wall=(0.87, 0.82, 0.78), feature_wall=(0.66, 0.44, 0.4),
        cabinet=(0.62, 0.32, 0.24), dark_wood=(0.45, 0.27, 0.15), light_wood=(0.7, 0.47, 0.28),
        rug=(0.4, 0.26, 0.3), rug_second=(0.8, 0.66, 0.58),
    ),
    Colours(
        upholstery=(0.3, 0.4, 0.5), accent=(0.82, 0.8, 0.72), second_accent=(0.76, 0.4, 0.3),
        curtain=(0.7, 0.66, 0.6), wall=(0.82, 0.83, 0.8), feature_wall=(0.28, 0.4, 0.45),
        cabinet=(0.34, 0.42, 0.42), dark_wood=(0.55, 0.42, 0.28), light_wood=(0.82, 0.68, 0.5),
        rug=(0.72, 0.62, 0.5), rug_second=(0.26, 0.36, 0.46),
    ),
    Colours(
        upholstery=(0.56, 0.3, 0.26), accent=(0.3, 0.44, 0.36), second_accent=(0.88, 0.78, 0.58),
        curtain=(0.36, 0.46, 0.4), wall=(0.88, 0.85, 0.77), feature_wall=(0.76, 0.62, 0.42),
        cabinet=(0.8, 0.72, 0.56), dark_wood=(0.37, 0.22, 0.13), light_wood=(0.6, 0.39, 0.24),
        rug=(0.3, 0.4, 0.35), rug_second=(0.82, 0.72, 0.52),
    ),
)  # fmt: skip
"""Schemes that a seed chooses from."""


@dataclass(frozen=True, eq=False)
class Look:
    """How a material looks.

    Attributes:
        image: (height, width, 3) picture in [0, 1], or None for one colour.
        colour: the colour where there is no picture.
        size_m: width and height of the picture on furniture, metres.
        specular, shininess, emission, reflectance: as MuJoCo has them, 0 to 1.
        alpha: 1 opaque, 0 invisible.
    """

    image: np.ndarray | None = field(default=None, repr=False)
    colour: Colour = (1.0, 1.0, 1.0)
    size_m: tuple[float, float] = (1.0, 1.0)
    specular: float = 0.15
    shininess: float = 0.3
    emission: float = 0.0
    reflectance: float = 0.0
    alpha: float = 1.0


Maker = Callable[[np.random.Generator, Colours, int], Look]
"""Makes a look in a scheme of colours, its picture with a `step` as of `textures`."""


def varied(rng: np.random.Generator, colour: Colour, amount: float = 0.03) -> Colour:
    """A colour close to `colour`."""
    red, green, blue = np.clip(np.array(colour) + rng.normal(0, amount, 3), 0.02, 0.98)
    return float(red), float(green), float(blue)


def look_of(name: str, rng: np.random.Generator, colours: Colours, step: int = 1) -> Look:
    """The look of the named material in a scheme of colours; `step` as of `textures`."""
    return MAKERS[name](rng, colours, step)


def _wood(dark: Colour | None, light: Colour | None, specular: float = 0.2) -> Maker:
    """Wood between two colours, by default the scheme's."""

    def make(rng: np.random.Generator, colours: Colours, step: int) -> Look:
        image = textures.wood(rng, 256, 512, dark or colours.dark_wood, light or colours.light_wood, step=step)
        return Look(image, size_m=(1.2, 0.6), specular=specular, shininess=0.4)

    return make


def _cloth(part: str, strength: float = 0.16) -> Maker:
    """A cloth in one of the scheme's colours."""

    def make(rng: np.random.Generator, colours: Colours, step: int) -> Look:
        colour = varied(rng, getattr(colours, part))
        image = textures.fabric(rng, 256, 256, colour, strength, step)
        return Look(image, size_m=(0.3, 0.3), specular=0.03, shininess=0.05)

    return make


def _plain(
    colour: Colour,
    specular: float = 0.15,
    shininess: float = 0.3,
    emission: float = 0.0,
    reflectance: float = 0.0,
    alpha: float = 1.0,
) -> Maker:
    """One colour without a picture."""
    look = Look(None, colour, (1.0, 1.0), specular, shininess, emission, reflectance, alpha)
    return lambda rng, colours, step: look


def _painted(colour: Colour | None, strength: float = 0.02, specular: float = 0.2, shininess: float = 0.4) -> Maker:
    """Paint or clay, by default in the scheme's cabinet colour."""

    def make(rng: np.random.Generator, colours: Colours, step: int) -> Look:
        image = textures.plaster(rng, 128, 128, colour or varied(rng, colours.cabinet, 0.02), strength, step)
        return Look(image, specular=specular, shininess=shininess)

    return make


def _metal(colour: Colour) -> Maker:
    """Brushed metal."""
    return lambda rng, colours, step: Look(
        textures.brushed(rng, 128, 128, colour, step), size_m=(0.5, 0.5), specular=0.7, shininess=0.6
    )


def _duvet(rng: np.random.Generator, colours: Colours, step: int) -> Look:
    """A bed cover: striped or printed."""
    base, second = varied(rng, colours.accent), colours.rug_second
    if rng.random() < 0.5:
        image = textures.striped(rng, 256, 256, second, base, 4, step)
    else:
        pattern = textures.WALLPAPERS[int(rng.integers(1, len(textures.WALLPAPERS)))]
        image = textures.wallpaper(rng, 256, 256, base, second, pattern, 3, step)
        image = image * textures.fabric(rng, 256, 256, (1, 1, 1), 0.1, step)
    return Look(np.clip(image, 0, 1), size_m=(0.8, 0.8), specular=0.03, shininess=0.05)


def _basket(rng: np.random.Generator, colours: Colours, step: int) -> Look:
    return Look(textures.wicker(rng, 192, 192, (0.72, 0.55, 0.34), step=step), size_m=(0.36, 0.3), specular=0.05)


def _granite(rng: np.random.Generator, colours: Colours, step: int) -> Look:
    tone = float(rng.choice([0.2, 0.3, 0.55]))
    return Look(
        textures.stone(rng, 256, 256, (tone, tone, tone * 1.03), step=step),
        size_m=(0.6, 0.6),
        specular=0.5,
        shininess=0.7,
    )


def _brick(rng: np.random.Generator, colours: Colours, step: int) -> Look:
    colour, grout = (0.62, 0.34, 0.26), (0.72, 0.68, 0.62)
    image = textures.tiles(rng, 256, 256, 4, 12, colour, grout, 0.16, 0.2, 2, bonded=True, step=step)
    return Look(image, size_m=(0.84, 0.84), specular=0.03)


def _marble(rng: np.random.Generator, colours: Colours, step: int) -> Look:
    image = textures.tiles(rng, 256, 256, 1, 1, (0.86, 0.85, 0.83), (1, 1, 1), 0.0, 0.22, 0, step=step)
    return Look(image, size_m=(1.0, 1.0), specular=0.5, shininess=0.7)


MAKERS: dict[str, Maker] = {
    "wood": _wood(None, None),
    "oak": _wood((0.52, 0.37, 0.22), (0.72, 0.55, 0.36)),
    "walnut": _wood((0.25, 0.15, 0.09), (0.45, 0.29, 0.18), 0.25),
    "pine": _wood((0.68, 0.52, 0.34), (0.84, 0.7, 0.5)),
    "upholstery": _cloth("upholstery"),
    "accent": _cloth("accent", 0.22),
    "second accent": _cloth("second_accent", 0.22),
    "curtain": _cloth("curtain", 0.12),
    "linen": lambda rng, colours, step: Look(
        textures.fabric(rng, 256, 256, (0.9, 0.89, 0.85), 0.07, step), size_m=(0.3, 0.3), specular=0.03, shininess=0.05
    ),
    "shade": lambda rng, colours, step: Look(
        textures.fabric(rng, 128, 128, (1.0, 0.93, 0.78), 0.1, step), size_m=(0.3, 0.3), specular=0.0, emission=0.7
    ),
    "duvet": _duvet,
    "basket": _basket,
    "white": _painted((0.9, 0.9, 0.88), specular=0.25, shininess=0.5),
    "trim": _painted((0.93, 0.93, 0.91), specular=0.1),
    "cabinet": _painted(None, specular=0.3, shininess=0.5),
    "terracotta": _painted((0.68, 0.38, 0.26), 0.15, 0.1),
    "cream": _painted((0.88, 0.82, 0.7), 0.05),
    "black": _plain((0.075, 0.075, 0.08), specular=0.4, shininess=0.5),
    "rubber": _plain((0.12, 0.12, 0.125), specular=0.1),
    "chrome": _plain((0.78, 0.79, 0.8), specular=1.0, shininess=0.9),
    "brass": _plain((0.74, 0.58, 0.3), specular=0.9, shininess=0.8),
    "steel": _metal((0.66, 0.67, 0.69)),
    "porcelain": _plain((0.93, 0.93, 0.92), specular=0.7, shininess=0.8),
    "bulb": _plain((1.0, 1.0, 0.95), emission=1.0),
    "leaf": _plain((0.18, 0.4, 0.14), specular=0.2),
    "young leaf": _plain((0.3, 0.52, 0.2), specular=0.2),
    "soil": _plain((0.2, 0.14, 0.1), specular=0.0),
    "glass": _plain((0.75, 0.86, 0.88), alpha=0.2, specular=1.0, shininess=0.9),
    "water": _plain((0.7, 0.86, 0.9), alpha=0.5, specular=0.9, shininess=0.9),
    "mirror": _plain((0.42, 0.45, 0.47), reflectance=0.85, specular=0.4, shininess=0.9),
    "brick": _brick,
    "soot": _plain((0.1, 0.09, 0.085), specular=0.0),
    "bark": _painted((0.36, 0.26, 0.18), 0.4, 0.05),
    "ember": _plain((1.0, 0.45, 0.15), emission=0.8, specular=0.0),
    "granite": _granite,
    "marble": _marble,
    "red": _painted((0.75, 0.22, 0.18)),
    "yellow": _painted((0.9, 0.75, 0.25)),
    "green": _painted((0.4, 0.6, 0.3)),
    "blue": _painted((0.25, 0.4, 0.65)),
}
"""How to make each named material."""
