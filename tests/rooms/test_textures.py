from __future__ import annotations

import itertools

import numpy as np
import pytest

from clearway.rooms import artwork, textures

DARK, LIGHT = (0.4, 0.25, 0.15), (0.7, 0.5, 0.3)
SURFACES = {
    "wood": lambda rng, step: textures.wood(rng, 96, 128, DARK, LIGHT, step=step),
    "planks": lambda rng, step: textures.planks(rng, 96, 128, 6, DARK, LIGHT, step=step),
    "parquet": lambda rng, step: textures.parquet(rng, 96, 96, 4, DARK, LIGHT, step=step),
    "tiles": lambda rng, step: textures.tiles(rng, 96, 96, 4, 4, LIGHT, DARK, step=step),
    "chessboard": lambda rng, step: textures.tiles(rng, 96, 96, 4, 4, LIGHT, DARK, second=(0.1, 0.1, 0.1), step=step),
    "fabric": lambda rng, step: textures.fabric(rng, 96, 96, LIGHT, step=step),
    "striped": lambda rng, step: textures.striped(rng, 96, 96, LIGHT, DARK, step=step),
    "pile": lambda rng, step: textures.pile(rng, 96, 96, LIGHT, DARK, step=step),
    "plaster": lambda rng, step: textures.plaster(rng, 96, 96, LIGHT, step=step),
    "stone": lambda rng, step: textures.stone(rng, 96, 96, LIGHT, step=step),
    "brushed": lambda rng, step: textures.brushed(rng, 96, 96, LIGHT, step=step),
    "wicker": lambda rng, step: textures.wicker(rng, 96, 96, LIGHT, step=step),
    **{
        f"{pattern} paper": lambda rng, step, pattern=pattern: textures.wallpaper(
            rng, 96, 96, LIGHT, DARK, pattern, 3, step=step
        )
        for pattern in textures.WALLPAPERS
    },
}
PICTURES = {
    "outdoor": lambda rng, step: artwork.outdoor(rng, 96, 128, step=step),
    "painting": lambda rng, step: artwork.painting(rng, 96, 128, step=step),
    "books": lambda rng, _: artwork.books(rng, 64, 128),
    "clock": lambda rng, _: artwork.clock(rng, 64),
    "screen": lambda rng, _: artwork.screen(rng, 64, 96),
    **{
        f"{pattern} rug": lambda rng, step, pattern=pattern: artwork.rug(rng, 96, 128, LIGHT, DARK, pattern, step=step)
        for pattern in artwork.RUGS
    },
}
ALL = SURFACES | PICTURES
STEPPED = [name for name in ALL if name not in ("books", "clock", "screen")]
SMOOTH = ("fabric", "plaster", "stone", "pile", "stripes paper", "damask paper", "dots paper")
OF_TWO_COLOURS = ("striped", *(name for name in ALL if name.endswith((" paper", " rug"))))


def made(name: str, seed: int = 3, step: int = 1) -> np.ndarray:
    return ALL[name](np.random.default_rng(seed), step)


def share_of_dark(image: np.ndarray) -> np.ndarray:
    """How far each pixel is on the way from LIGHT to DARK, (height, width)."""
    way = np.subtract(DARK, LIGHT)
    return (image - LIGHT) @ way / (way @ way)


def change(image: np.ndarray, axis: int) -> float:
    """The mean difference of neighbours: axis 0 down a column, 1 along a row."""
    return float(np.abs(np.diff(image, axis=axis)).mean())


@pytest.mark.parametrize("name", ALL)
def test_pictures_are_colours_in_range_and_repeat_with_the_seed(name):
    image = made(name)
    assert image.ndim == 3
    assert image.shape[2] == 3
    assert np.isfinite(image).all()
    assert image.min() >= 0
    assert image.max() <= 1
    assert np.array_equal(image, made(name))
    assert not np.array_equal(image, made(name, seed=4))


def test_no_two_look_alike():
    for kind in (" paper", " rug"):
        images = [made(name) for name in ALL if name.endswith(kind)]
        for one, other in itertools.combinations(images, 2):
            assert np.abs(one - other).mean() > 0.02


@pytest.mark.parametrize("name", OF_TWO_COLOURS)
def test_a_pattern_shows_both_its_colours(name):
    share = share_of_dark(made(name))
    low, high = np.quantile(share, [0.05, 0.95])
    assert (share < 0.3).mean() > 0.2 and low < 0.1
    assert high > 0.4 and share.max() > 0.55


@pytest.mark.parametrize("name", ["fabric", "plaster", "stone", "brushed"])
def test_one_colour_varies_in_brightness_alone(name):
    image = made(name)
    brightness = image[image.max(axis=2) < 1] / LIGHT  # what is not cut off
    assert np.allclose(brightness, brightness[..., :1])
    assert brightness.mean() == pytest.approx(1, abs=0.01)
    assert brightness.std() > 0.01


@pytest.mark.parametrize("surface", [textures.fabric, textures.plaster, textures.stone])
def test_strength_scales_the_difference_from_the_colour(surface):
    none, once, twice = (surface(np.random.default_rng(3), 32, 32, LIGHT, strength) for strength in (0, 0.05, 0.1))
    assert np.allclose(none, LIGHT)
    assert np.allclose(twice - LIGHT, 2 * (once - LIGHT)) and not np.allclose(once, none)


@pytest.mark.parametrize("name", ["wood", "planks", "brushed"])
def test_grain_runs_along_the_width(name):
    assert change(made(name), axis=0) > 1.3 * change(made(name), axis=1)


@pytest.mark.parametrize("name", ["striped", "stripes paper"])
def test_stripes_stand_upright(name):
    assert change(made(name), axis=1) > 3 * change(made(name), axis=0)


@pytest.mark.parametrize("pattern", textures.WALLPAPERS)
def test_a_wallpaper_repeats_as_often_as_asked(pattern):
    share = share_of_dark(made(f"{pattern} paper"))  # 96 pixels, 3 repeats
    for axis in (0, 1):
        assert np.abs(share - np.roll(share, 32, axis)).mean() < 0.04
    upright = pattern == "stripes"  # which are alike wherever one begins above
    assert upright or np.abs(share - np.roll(share, 16, 0)).mean() > 0.06
    assert np.abs(share - np.roll(share, 8, 1)).mean() > 0.06


def test_strands_of_wicker_go_over_and_under_in_turn():
    strands = made("wicker")[..., 0].reshape(12, 8, 6, 16).mean(axis=(1, 3))  # 12 across, each over 2 of 12
    over = np.indices(strands.shape).sum(axis=0) % 2 == 1
    assert strands[over].min() > strands[~over].max()


def test_a_clock_has_twelve_marks_and_its_hands():
    face = artwork.clock(np.random.default_rng(3), 192)[..., 0]
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False) + 0.01

    def dark(radius: float) -> np.ndarray:
        return (
            face[(96 - 96 * radius * np.cos(angle)).astype(int), (96 + 96 * radius * np.sin(angle)).astype(int)] < 0.5
        )

    def stretches(along: np.ndarray) -> int:
        return int((along & ~np.roll(along, 1)).sum())

    assert stretches(dark(0.84)) == 12 and stretches(dark(0.96)) == 0
    assert stretches(dark(0.4)) == 2 and stretches(dark(0.65)) == 1  # both hands, and the longer one alone


def test_a_painting_hangs_in_its_mount():
    for seed in range(8):
        image = made("painting", seed)
        border = round(0.08 * 96)
        inside = image[border:-border, border:-border]
        assert (image[:border] == 0.94).all() and (image[:, -border:] == 0.94).all()
        assert inside.std(axis=(0, 1)).max() > 0.03


def test_books_stand_on_the_shelf_below_a_dark_gap():
    image = made("books")
    assert (image[0] == 0.1).all()
    assert len(np.unique(image[-1].round(2), axis=0)) > 20
    assert (np.abs(image[-1] - 0.1).max(axis=1) > 0.02).mean() > 0.8


def test_the_window_shows_sky_above_and_a_lawn_below():
    for seed in range(8):
        red, green, blue = np.moveaxis(made("outdoor", seed), 2, 0)
        assert (blue[:10] >= red[:10]).all() and blue[:10].mean() > 0.8
        assert (green[-10:] > red[-10:]).all() and (green[-10:] > blue[-10:]).all()
        assert green[-10:].mean() > 0.4  # lighter than trees


def test_a_screen_is_dark_with_its_reflection_above():
    image = made("screen")
    assert image.max() < 0.35 and image[:16].mean() > 1.5 * image[-16:].mean()


@pytest.mark.parametrize("pattern", artwork.RUGS)
def test_a_rug_has_a_dark_border_with_a_light_line(pattern):
    share = share_of_dark(made(f"{pattern} rug"))
    assert share[0].mean() > 0.8 and share[7].mean() > 0.8  # rows of 96
    assert share[4, 10:-10].mean() < 0.3


def test_noise_is_tileable_and_centred():
    field = textures.noise(np.random.default_rng(0), 128, 96, 1.5)
    assert field.mean() == pytest.approx(0.5, abs=0.02)
    inside = np.abs(np.diff(field, axis=0)).mean(), np.abs(np.diff(field, axis=1)).mean()
    across = np.abs(field[0] - field[-1]).mean(), np.abs(field[:, 0] - field[:, -1]).mean()
    assert across == pytest.approx(inside, rel=0.5)


@pytest.mark.parametrize("name", SMOOTH)
def test_textures_repeat_without_a_seam(name):
    image = made(name, seed=1)
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


def means(image: np.ndarray, side: int) -> np.ndarray:
    """The mean of every `side` x `side` pixels, (height / side, width / side, 3)."""
    height, width, _ = image.shape
    return image.reshape(height // side, side, width // side, side, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("name", STEPPED)
def test_every_second_pixel_shows_the_same_picture(name):
    for seed in range(3):
        whole, rng = made(name, seed), np.random.default_rng(seed)
        half = ALL[name](rng, 2)
        assert half.shape == (whole.shape[0] // 2, whole.shape[1] // 2, 3) and half.min() >= 0 and half.max() <= 1
        after = np.random.default_rng(seed)
        ALL[name](after, 1)
        assert rng.bit_generator.state == after.bit_generator.state  # what comes next is the same too
        same, other = (np.abs(means(one, 8) - means(half, 4)).mean() for one in (whole, made(name, seed + 10)))
        assert same < 0.016
        assert not name.endswith(" paper") or np.abs(means(whole, 2) - half).mean() < 0.004
        assert same < 0.6 * other or name in (*OF_TWO_COLOURS, "wicker")  # whose pattern is the same with every seed


def test_coarser_noise_is_the_same_field_without_what_is_too_fine():
    for exponent, stretch in ((0.3, 1.0), (1.3, 2.5), (1.7, 6.0)):
        fields = [textures.noise(np.random.default_rng(4), 96, 128, exponent, stretch, step=step) for step in (1, 2, 4)]
        assert [field.shape for field in fields] == [(96, 128), (48, 64), (24, 32)]
        spectra = [np.fft.rfft2(field)[:12, 1:16] / field.size for field in fields]
        for coarser in spectra[1:]:
            assert np.abs(coarser - spectra[0]).mean() < 0.1 * np.abs(spectra[0]).mean()
    uneven = textures.noise(np.random.default_rng(4), 97, 131, 1.3, step=2)
    assert uneven.shape == (49, 66)


@pytest.mark.parametrize(("step", "brightness"), [(1, 0.55), (2, 0.775), (4, 0.8875)])
def test_seams_keep_their_places_and_grow_paler_instead_of_broader(step, brightness):
    floor = textures.planks(np.random.default_rng(3), 96, 128, 6, LIGHT, LIGHT, step)
    for seam in np.arange(0, 96, 16) // step:
        assert np.median(floor[seam] / floor[seam + 1]) == pytest.approx(brightness)
        assert np.median(floor[seam + 2] / floor[seam + 1]) == pytest.approx(1)


@pytest.mark.parametrize("bonded", [False, True])
@pytest.mark.parametrize("side", [80, 84, 85])
def test_no_line_of_grout_gets_lost(side, bonded):
    whole, half = (
        textures.tiles(
            np.random.default_rng(0), side, side, 4, 6, (0.9,) * 3, (0.1,) * 3, 0.0, 0.0, 2, bonded, step=step
        ).mean(axis=2)
        for step in (1, 2)
    )
    dark = np.pad(whole < 0.2, ((0, side % 2), (0, side % 2)), "edge").astype(float)
    shares = dark.reshape(len(half), 2, len(half), 2).mean(axis=(1, 3))
    inner = slice(0, -1) if side % 2 else slice(None)
    assert (0.9 - half)[inner, inner] == pytest.approx(0.8 * shares[inner, inner], abs=0.05)
    assert (half < 0.6).any(axis=0).sum() > len(half) / 4
