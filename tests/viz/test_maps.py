"""Maps: where zones and walks lie, and that the picture is drawn with and without a view from above."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from clearway import colours
from clearway.viz import maps
from clearway.viz.figures import LINES
from clearway.viz.maps import Walk, _triangles, draw_map
from clearway.zones import scene_zones
from made import corridor_scene, grid_scene

PATH = np.array([0, 4, 8, 9, 9, 10])  # forward twice, right, blocked, right


def test_a_walk_knows_its_blocked_moves():
    assert Walk("x", PATH).bumps.tolist() == [False, False, False, True, False]


def test_the_triangle_of_a_pose_lies_where_it_looks():
    scene = corridor_scene(3)
    middle = _triangles(scene).mean(axis=1) - scene.locations_m
    towards = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])[scene.headings_deg // 90]
    along, across = (middle * towards).sum(1), np.abs(middle * towards[:, ::-1]).sum(1)
    assert (along > 0.1).all() and np.allclose(across, 0)


@pytest.mark.parametrize("from_above", [True, False])
def test_a_map_is_drawn(tmp_path, from_above):
    scene = corridor_scene(5)
    if not from_above:
        scene = replace(scene, top_view=None)
    path = tmp_path / "deep" / "map.png"
    walks = [Walk("first", PATH), Walk("second", PATH[:3])]
    draw_map(scene, path, zones=scene_zones(scene), target=10, walks=walks, title="A corridor")
    picture = np.asarray(Image.open(path).convert("RGB"))
    assert picture.shape[1] > 800 and picture.std() > 10
    assert [file.name for file in path.parent.iterdir()] == ["map.png"]


def rgb(colour: str) -> list[int]:
    return list(bytes.fromhex(colour[1:]))


def test_star_and_line_stand_at_their_poses(tmp_path, monkeypatch):
    scene, kept = grid_scene(1), []
    monkeypatch.setattr(maps, "_draw_scale_bar", lambda axes, right_m, low_m: kept.append(axes))
    states = [0]
    while len(states) < 30:  # along the walls: forward, or else to the right
        ahead, aside = (int(scene.graph[states[-1], action]) for action in (0, 1))
        states.append(ahead if ahead >= 0 else aside)
    target = int(np.flatnonzero(~np.isin(scene.cells, scene.cells[states]))[0])
    draw_map(
        scene,
        tmp_path / "map.png",
        zones=np.zeros(scene.state_count, int),
        target=target,
        walks=[Walk("", np.array(states))],
    )
    picture = np.asarray(Image.open(tmp_path / "map.png").convert("RGB"))

    def at(place_m: np.ndarray) -> list[int]:
        column, row = kept[0].transData.transform(place_m)
        return picture[len(picture) - 1 - round(row), round(column)].tolist()

    assert at(scene.locations_m[target]) == rgb(colours.TARGET)
    places_m = scene.locations_m[states]
    moved = (places_m[1:] != places_m[:-1]).any(axis=1)
    on_line = (0.7 * places_m[:-1] + 0.3 * places_m[1:])[moved]
    middle_m = (scene.locations_m.min(axis=0) + scene.locations_m.max(axis=0)) / 2
    assert len(np.unique(on_line, axis=0)) >= 4 and (np.abs(on_line - middle_m) > 0.1).any(axis=0).all()
    assert [at(place_m) for place_m in on_line] == [rgb(LINES[0].colour)] * len(on_line)


def test_zones_change_the_map_and_nothing_else_is_needed(tmp_path):
    scene = grid_scene(1)
    zones = scene_zones(scene)
    draw_map(scene, tmp_path / "zones.png", zones=zones)
    draw_map(scene, tmp_path / "again.png", zones=zones)
    draw_map(scene, tmp_path / "free.png", zones=np.zeros_like(zones))
    pictures = [np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("zones", "again", "free")]
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
