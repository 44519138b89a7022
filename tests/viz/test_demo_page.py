"""The demo's page: what it says is what was measured, and it shows nothing that is not there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from importlib.resources import files
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from clearway.experiments.demo import DemoRequest, DemoResult, run_demo
from clearway.viz import demo_page
from clearway.viz.demo_page import VIEWS, make_demo_page
from clearway.viz.figures import BY_REWARD, LINES
from clearway.viz.page import KeyFigure, Opening, Picture
from clearway.zones import scene_zones
from helpers.small_demo import shrink_demo

COMMAND = "clearway demo --out 'a <b> & c'"


class Shown(HTMLParser):
    """The text, the links and the pictures of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text, self.links, self.pictures = "", [], {}
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        kept = dict(attributes)
        self.links += [kept[name] for name in ("src", "href") if name in kept]
        if tag == "img":
            self.pictures[kept["src"]] = kept["alt"]

    def handle_data(self, data: str) -> None:
        self.text += data + "\n"


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DemoResult]:
    with pytest.MonkeyPatch.context() as patch:
        shrink_demo(patch)
        yield run_demo(
            DemoRequest(tmp_path_factory.mktemp("demo") / "demo", seed=2, frames=800, encoder="auto", room_seed=3)
        )


@pytest.fixture(scope="module")
def shown(result: DemoResult) -> Shown:
    return Shown(make_demo_page(result, COMMAND).read_text(encoding="utf-8"))


def test_every_link_leads_to_a_picture_beside_the_page(result, shown):
    assert set(shown.links) == set(shown.pictures)
    for link in shown.links:
        assert not link.startswith(("/", "http", "..", "file:"))
        with Image.open(result.out / link) as picture:
            picture.verify()
    assert all(shown.pictures.values())  # what those hear who do not see


@pytest.mark.slow
def test_it_opens_with_the_pictures_that_are_given(result):
    opening = Opening([KeyFigure("bumps", "0.1")], [Picture("pictures/map.png", "Both & each", "both")], "Chosen.")
    page = make_demo_page(result, COMMAND, opening).read_text(encoding="utf-8")
    places = [page.index(text) for text in ("bumps", "Both &amp; each", "Chosen.", "Before anything is trained")]
    assert places == sorted(places)


def test_all_pictures_are_shown(shown):
    views = [f"pictures/view-{number}.png" for number in range(VIEWS)]
    episodes = [f"pictures/episode-{agent}.png" for agent in ("collision-aware", "shortest")]
    unseen = [f"pictures/unseen-{what}.png" for what in ("map", "belief", "episode")]
    assert set(shown.pictures) == {"pictures/map.png", "pictures/curves.png", *views, *episodes, *unseen}


def test_the_generalist_is_shown_in_a_room_of_the_seed_first(result, shown):
    first = result.first
    assert (first.seed, first.scene.name) == (3, "room-3")
    assert first.collisions == sum(a == b for a, b in pairwise(first.walk.states.tolist()))
    assert first.reached == (first.walk.states[-1] == first.target)
    steps = len(first.walk.actions)
    assert f"{steps} step" in shown.text and f"the shortest path has {first.shortest_path_steps}." in shown.text
    assert "made from seed 3" in shown.text
    assert shown.text.index("Before anything is trained") < shown.text.index("The figures")


def test_four_rows_stand_open_and_all_are_folded(result, shown):
    assert "All rows" in shown.text
    page = (result.out / "index.html").read_text(encoding="utf-8")
    table, folded, _ = page[page.index("<h2>The figures") :].split("<details>", 2)
    names = re.findall(r'<th scope="row">\s*([^<\n]+)', table)
    assert names == ["collision-aware", "shortest", "random", "shortest path"]
    assert len(re.findall('<th scope="row">', folded)) == len(result.evaluations) > 4


@pytest.mark.slow
def test_an_agent_has_one_colour_on_the_map_in_the_curves_and_in_the_viewer(result, monkeypatch):
    curves = []
    monkeypatch.setattr(demo_page, "draw_curves", lambda runs, path, looks: curves.append((list(runs), looks)))
    make_demo_page(result, COMMAND)
    assert curves == [(["shortest", "collision-aware"], LINES)]  # as the walks on the map, see below
    script = (files("clearway.view") / "page/looks.js").read_text()
    viewer = re.findall(r'colour: "(#\w+)", halo: "(#\w+)"', script)
    assert viewer[:2] == [(look.colour, look.halo) for look in BY_REWARD.values()]
    assert list(BY_REWARD.values()) == list(LINES[:2])


def test_the_page_says_what_made_it(shown):
    for fact in (COMMAND, "made-up", "PPO, 800 frames an agent, seed 2", "torch ", "cores ", "5 episodes a target"):
        assert fact in shown.text
    for agent in ("collision-aware", "shortest", "random", "shortest path"):
        assert f"\n{agent}\n" in shown.text


@pytest.mark.slow
def test_both_agents_are_drawn_on_one_map_from_one_start(result, monkeypatch):
    maps, sheets = [], []
    monkeypatch.setattr(demo_page, "draw_map", lambda scene, path, **drawn: maps.append(drawn))
    monkeypatch.setattr(demo_page, "draw_contact_sheet", lambda scene, path, **drawn: sheets.append(drawn))
    make_demo_page(result, COMMAND)
    unseen, drawn = maps
    assert [walk.label for walk in unseen["walks"]] == ["generalist"] and unseen["target"] == result.first.target
    assert [walk.label for walk in drawn["walks"]] == ["shortest", "collision-aware"]
    assert len({int(walk.states[0]) for walk in drawn["walks"]}) == 1
    assert drawn["target"] == result.showcase.target
    assert np.array_equal(drawn["zones"], scene_zones(result.scene))
    for walk, sheet in zip(drawn["walks"], sheets[1:], strict=True):
        assert np.array_equal(walk.states, sheet["states"])
        assert sheet["title"] == f"{walk.label} agent"


def test_views_are_pictures_of_the_scene_from_different_cells(result, shown):
    pictures = result.scene.observations[:]
    cells = set()
    for number in range(VIEWS):
        view = np.asarray(Image.open(result.out / f"pictures/view-{number}.png"))
        (poses,) = np.nonzero((pictures == view).all(axis=(1, 2, 3)))
        assert len(poses) == 1
        cells.add(int(result.scene.cells[poses[0]]))
        x_m, z_m = result.scene.locations_m[poses[0]]
        heading_deg = result.scene.headings_deg[poses[0]]
        assert f"From x {x_m:.2f} m, z {z_m:.2f} m, heading {heading_deg}°" in shown.text
    assert len(cells) == VIEWS
