"""Maps: where zones and walks lie, and that the picture is drawn with and without a view from above."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

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


def test_zones_change_the_map_and_nothing_else_is_needed(tmp_path):
    scene = grid_scene(1)
    zones = scene_zones(scene)
    draw_map(scene, tmp_path / "zones.png", zones=zones)
    draw_map(scene, tmp_path / "again.png", zones=zones)
    draw_map(scene, tmp_path / "free.png", zones=np.zeros_like(zones))
    pictures = [np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("zones", "again", "free")]
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
