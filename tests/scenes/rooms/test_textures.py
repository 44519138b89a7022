from __future__ import annotations

import numpy as np
import pytest

from clearway.scenes.rooms import pictures, textures

DARK, LIGHT = (0.4, 0.25, 0.15), (0.7, 0.5, 0.3)
SURFACES = {
    "wood": lambda rng: textures.wood(rng, 96, 128, DARK, LIGHT),
    "planks": lambda rng: textures.planks(rng, 96, 128, 6, DARK, LIGHT),
    "parquet": lambda rng: textures.parquet(rng, 96, 96, 4, DARK, LIGHT),
    "tiles": lambda rng: textures.tiles(rng, 96, 96, 4, 4, LIGHT, DARK),
    "chessboard": lambda rng: textures.tiles(rng, 96, 96, 4, 4, LIGHT, DARK, second=(0.1, 0.1, 0.1)),
    "fabric": lambda rng: textures.fabric(rng, 96, 96, LIGHT),
    "striped": lambda rng: textures.striped(rng, 96, 96, LIGHT, DARK),
    "pile": lambda rng: textures.pile(rng, 96, 96, LIGHT, DARK),
    "plaster": lambda rng: textures.plaster(rng, 96, 96, LIGHT),
    "stone": lambda rng: textures.stone(rng, 96, 96, LIGHT),
    "brushed": lambda rng: textures.brushed(rng, 96, 96, LIGHT),
    "wicker": lambda rng: textures.wicker(rng, 96, 96, LIGHT),
    **{
        pattern: lambda rng, pattern=pattern: textures.wallpaper(rng, 96, 96, LIGHT, DARK, pattern, 3)
        for pattern in textures.WALLPAPERS
    },
}
PICTURES = {
    "outdoor": lambda rng: pictures.outdoor(rng, 96, 128),
    "painting": lambda rng: pictures.painting(rng, 96, 128),
    "books": lambda rng: pictures.books(rng, 64, 128),
    "clock": lambda rng: pictures.clock(rng, 64),
    "screen": lambda rng: pictures.screen(rng, 64, 96),
    **{
        pattern: lambda rng, pattern=pattern: pictures.rug(rng, 96, 128, LIGHT, DARK, pattern)
        for pattern in pictures.RUGS
    },
}
ALL = SURFACES | PICTURES
SMOOTH = ("fabric", "plaster", "stone", "pile", "stripes", "damask", "dots")


@pytest.mark.parametrize("name", ALL)
def test_pictures_are_colours_in_range_and_repeat_with_the_seed(name):
    image = ALL[name](np.random.default_rng(3))
    assert image.ndim == 3
    assert image.shape[2] == 3
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert image.max() <= 1
    assert image.std() > 0.001
    assert np.array_equal(image, ALL[name](np.random.default_rng(3)))
    assert not np.array_equal(image, ALL[name](np.random.default_rng(4)))


def test_noise_is_tileable_and_centred():
    field = textures.noise(np.random.default_rng(0), 128, 96, 1.5)
    assert field.mean() == pytest.approx(0.5, abs=0.02)
    inside = np.abs(np.diff(field, axis=0)).mean(), np.abs(np.diff(field, axis=1)).mean()
    across = np.abs(field[0] - field[-1]).mean(), np.abs(field[:, 0] - field[:, -1]).mean()
    assert across == pytest.approx(inside, rel=0.5)


@pytest.mark.parametrize("name", SMOOTH)
def test_textures_repeat_without_a_seam(name):
    image = SURFACES[name](np.random.default_rng(1))
    for axis in (0, 1):
        inside = np.abs(np.diff(image, axis=axis)).mean(axis=(1 - axis, 2))
        seam = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        assert seam <= inside.max() * 1.2


def test_tiles_have_grout_at_every_joint():
    image = textures.tiles(np.random.default_rng(0), 80, 80, 4, 4, (0.9, 0.9, 0.9), (0.1, 0.1, 0.1), 0.0, 0.0, 2)
    dark = image.mean(axis=2) < 0.2
    assert dark[:, [0, 1, 20, 21, 40, 60]].all()
    assert dark[[0, 20, 40, 60]].all()
    assert not dark[5:19, 5:19].any()


def test_a_chessboard_alternates():
    image = textures.tiles(
        np.random.default_rng(0), 80, 80, 4, 4, (0.9, 0.9, 0.9), (0.5, 0.5, 0.5), 0.0, 0.0, 0, second=(0.1, 0.1, 0.1)
    )
    middles = image[10::20, 10::20, 0]
    assert np.array_equal(middles > 0.5, (np.indices((4, 4)).sum(axis=0) % 2) == 0)
