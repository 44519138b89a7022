"""The page's files, read as text: nothing from elsewhere, nothing inline, colours that agree and can be read."""

import re
from importlib import resources

import pytest

from clearway import colours
from clearway.scenes.actions import ACTION_COUNT
from clearway.viz.figures import LINES
from clearway.viz.maps import HATCH_INK, ZONE_OPACITY
from clearway.zones import Zone

PAGE = {file.name: file.read_text(encoding="utf-8") for file in (resources.files("clearway.view") / "page").iterdir()}
HTML, CSS, LOOKS = PAGE["index.html"], PAGE["style.css"], PAGE["looks.js"]
LEAST_CONTRAST = 4.5  # WCAG 2.2, level AA, text


@pytest.mark.parametrize("name", PAGE)
def test_nothing_comes_from_elsewhere(name: str) -> None:
    addresses = set(re.findall(r"https?://[^\s\"')]+|url\([^)]*\)|@import", PAGE[name]))
    assert addresses <= {"http://www.w3.org/2000/svg"}  # the name of a namespace, not an address


def test_nothing_is_inline() -> None:
    assert not re.findall(r"\s(?:style|on\w+)=|<style|<script(?![^>]*src=)|javascript:", HTML)
    assert not [
        name for name, text in PAGE.items() if re.search(r"innerHTML|outerHTML|insertAdjacentHTML|\beval\(", text)
    ]


def test_every_part_that_the_page_asks_for_is_there_once() -> None:
    ids = re.findall(r'\sid="([^"]+)"', HTML)
    assert len(ids) == len(set(ids))
    asked = set(re.findall(r'\$\("([\w-]+)"\)', PAGE["app.js"]))
    assert asked and asked <= set(ids)
    references = re.findall(r'aria-(?:labelledby|describedby)="([^"]+)"|\bfor="([^"]+)"', HTML)
    assert {name for pair in references for name in pair if name} <= set(ids)
    assert all("aria-label" in tag or "title" in tag for tag in re.findall(r"<button[^>]*>(?=<svg)", HTML))


def test_the_colours_are_those_of_all_other_maps() -> None:
    zones = re.search(r"ZONES = \[(.*?)\]", LOOKS)
    assert zones is not None
    assert re.findall(r"#\w+", zones[1]) == [colours.ZONE_COLOURS[zone.name.lower()] for zone in Zone]
    opacity = f"ZONE_OPACITY = [0, {ZONE_OPACITY[Zone.PRECOLLISION]}, {ZONE_OPACITY[Zone.COLLISION]}]"
    assert opacity in LOOKS
    for name, colour in {
        "WALL": colours.WALL,
        "TARGET": colours.TARGET,
        "INK": colours.INK,
        "HATCH_INK": HATCH_INK,
    }.items():
        assert f'export const {name} = "{colour}";' in LOOKS
    walkers = re.findall(r'colour: "(#\w+)", halo: "(#\w+)"', LOOKS)
    assert walkers == [(line.colour, line.halo) for line in LINES[:3]]
    assert len(re.findall(r"turn: -?\d+, path", LOOKS)) == ACTION_COUNT


def luminance(colour: str) -> float:
    """Relative luminance, as WCAG 2.2 defines it."""
    shares = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    red, green, blue = (share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(
    ("ink", "paper"),
    [
        *((ink, paper) for ink in ("ink", "soft") for paper in ("paper", "card", "sunk")),
        ("ink", "raised"),
        ("accent", "paper"),
        ("on-accent", "accent"),
        ("failed", "card"),
        ("paper", "ink"),
    ],
)
def test_text_can_be_read(scheme: str, ink: str, paper: str) -> None:
    light, dark = (
        dict(re.findall(r"--([\w-]+): (#\w{6});", block)) for block in re.findall(r":root \{(.*?)\}", CSS, re.S)[:2]
    )
    scheme_colours = light | dark if scheme == "dark" else light
    high, low = sorted((luminance(scheme_colours[name]) for name in (ink, paper)), reverse=True)
    assert (high + 0.05) / (low + 0.05) >= LEAST_CONTRAST
