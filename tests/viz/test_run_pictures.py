"""Pictures of a run: a map and a contact sheet for each scene, and the learning curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from clearway.learn.load import load_agent
from clearway.learn.train import train
from clearway.viz import run_pictures
from clearway.viz.run_pictures import draw_run_pictures
from clearway.zones import scene_zones
from helpers.small_pictures import shrink_pictures
from helpers.small_runs import small_learner, small_request, small_scenes, small_targets


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run folder and its agent, trained on zones of whole cells."""
    request = small_request(learner=small_learner(frames=160), zone_level="cell")
    path = train(request, tmp_path_factory.mktemp("run") / "run").path
    return path, load_agent(path)


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    shrink_pictures(monkeypatch)


def is_png(path) -> bool:
    with Image.open(path) as picture:
        picture.load()
        return picture.format == "PNG" and min(picture.size) > 100


@pytest.mark.slow
def test_every_scene_gets_a_map_and_its_views(run, tmp_path):
    made = draw_run_pictures(*run, small_scenes(), tmp_path / "new" / "pictures")
    names = ["curves.png", "map-corridor.png", "episode-corridor.png", "map-grid.png", "episode-grid.png"]
    assert [path.name for path in made] == names
    assert sorted(path.name for path in (tmp_path / "new" / "pictures").iterdir()) == sorted(names)
    assert all(is_png(path) for path in made)


@pytest.mark.slow
def test_scenes_without_pictures_get_no_contact_sheet(run, tmp_path):
    corridor, grid = small_scenes()
    made = draw_run_pictures(*run, [corridor, replace(grid, observations=None, top_view=None)], tmp_path)
    assert [path.name for path in made] == ["curves.png", "map-corridor.png", "episode-corridor.png", "map-grid.png"]
    assert all(is_png(path) for path in made)


def test_maps_and_sheets_show_one_walk_in_the_zones_of_the_run(run, tmp_path, monkeypatch):
    maps, sheets, curves = [], [], []
    monkeypatch.setattr(run_pictures, "draw_map", lambda scene, path, **shown: maps.append((scene, shown)))
    monkeypatch.setattr(run_pictures, "draw_contact_sheet", lambda scene, path, **shown: sheets.append(shown))
    monkeypatch.setattr(run_pictures, "draw_curves", lambda rows, path: curves.append(rows))
    draw_run_pictures(*run, small_scenes(), tmp_path, seed=2)
    for (scene, on_map), on_sheet in zip(maps, sheets, strict=True):
        assert np.array_equal(on_map["zones"], scene_zones(scene, "cell"))
        assert np.array_equal(on_sheet["zones"], scene_zones(scene, "cell"))
        assert not np.array_equal(on_map["zones"], scene_zones(scene, "pose"))
        (walk,) = on_map["walks"]
        assert walk.label == on_sheet["title"] == "collision-aware"
        assert np.array_equal(walk.states, on_sheet["states"])
        assert on_map["target"] == on_sheet["target"] and on_map["target"] in small_targets()[scene.name]
    (rows,) = curves
    assert rows["collision-aware"][-1]["frames"] == 160


@pytest.mark.slow
def test_the_seed_chooses_the_episode(run, tmp_path):
    pictures = [
        {path.name: path.read_bytes() for path in draw_run_pictures(*run, small_scenes(), tmp_path / name, seed=seed)}
        for name, seed in (("a", 0), ("b", 0), ("c", 1))
    ]
    assert pictures[0] == pictures[1]
    assert pictures[0]["map-grid.png"] != pictures[2]["map-grid.png"]
    assert pictures[0]["curves.png"] == pictures[2]["curves.png"]
