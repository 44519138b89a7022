from __future__ import annotations

import numpy as np
import pytest

from clearway import rooms
from clearway.errors import RenderError, SceneError
from clearway.rooms import build
from clearway.rooms.build import build_floor_plan, build_scene
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Provenance
from clearway.scenes.validate import check_scene
from clearway.version import __version__
from helpers.small_rooms import SmallRoom


@pytest.fixture
def small_room(monkeypatch) -> SmallRoom:
    """A room of 3 cells in a row along x, with a floor and a post, in place of the real ones."""
    room = SmallRoom(width_m=1.5, depth_m=0.5, grid_origin_m=(0.25, 0.25))
    room.add_box((0.0, 1.5), (0.0, 0.5), (-0.1, 0.0), group=2, rgb=(0.2, 0.4, 0.6))
    room.add_box((3.0, 3.2), (0.0, 0.5), group=2, rgb=(0.9, 0.2, 0.2))
    monkeypatch.setattr(rooms, "build_room", lambda name, seed: room)
    return room


def test_a_room_becomes_a_scene(small_room):
    scene = build_scene("bathroom", 3, workers=1)
    assert scene.name == "bathroom-3"
    assert scene.state_count == 12 and scene.cell_count == 3
    assert scene.observations.shape == (12, 300, 400, 3) and scene.observations.dtype == np.uint8
    assert scene.features is None and scene.encoder is None
    assert scene.locations_m[::4].tolist() == [[0.25, 0.25], [0.75, 0.25], [1.25, 0.25]]
    assert scene.headings_deg[:5].tolist() == [0, 90, 180, 270, 0]
    assert scene.graph[1].tolist() == [5, 2, 0, -1]
    assert scene.cell_size_m == 0.5
    assert scene.top_view.image.shape == (50, 150, 3)
    red = scene.observations[1][150, 200]  # at heading 90 the post at +x is ahead
    assert red[0] > 2 * red[1]
    assert isinstance(scene.made_by, Provenance)
    assert (scene.made_by.source, scene.made_by.room, scene.made_by.seed) == ("room", "bathroom", 3)
    assert scene.made_by.versions["clearway"] == __version__
    assert set(scene.made_by.versions) == {"clearway", "mujoco", "numpy", "scipy"}


@pytest.mark.slow
def test_a_room_is_rendered_in_depth_on_request(small_room):
    colour = build_scene("bathroom", workers=1)
    scene = build_scene("bathroom", sensors=("rgb", "depth"), workers=1)
    assert [sensor.name for sensor in colour.sensors] == ["rgb"]
    assert [sensor.name for sensor in scene.sensors] == ["rgb", "depth"]
    np.testing.assert_array_equal(scene.observations, colour.observations)
    ahead_m = scene.seen_by("depth")[np.array([1, 5, 9])][:, 150, 200]  # at heading 90 the post at x = 3 is ahead
    np.testing.assert_allclose(ahead_m, [2.75, 2.25, 1.75], atol=0.0011)
    check_scene(scene)


@pytest.mark.parametrize(
    ("sensors", "problem"),
    [
        (("rgb", "sonar"), "'sonar'. Choose among rgb, depth"),
        (("depth",), "leaves out rgb"),
        (("rgb", "rgb"), "names one twice"),
    ],
)
def test_sensors_that_cannot_be_had_are_refused(sensors, problem):
    with pytest.raises(SceneError, match=problem):
        build_scene("bathroom", sensors=sensors)


@pytest.mark.slow
def test_the_default_room_has_the_rooms_name(small_room):
    assert build_scene("bathroom", workers=1).name == "bathroom"


def test_an_unknown_room_is_refused():
    with pytest.raises(SceneError, match="ballroom: there is no room of this name"):
        build_scene("ballroom")


@pytest.mark.parametrize("error", [ImportError, AttributeError, RuntimeError, OSError])
def test_a_mujoco_that_does_not_import_is_one_clear_error(monkeypatch, error):
    def fail(name):
        raise error("'NoneType' object has no attribute 'eglQueryString'")

    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setattr(build, "import_module", fail)
    with pytest.raises(RenderError, match=r"MUJOCO_GL=egl .*eglQueryString.*apt-get install libegl1"):
        build_scene("bathroom")


def test_a_floor_plan_becomes_a_furnished_scene():
    plan = FloorPlan("nook", np.array([[4, -2], [5, -2], [4, -1]]), np.array([[[4, -2], [5, -2]]]), cell_size_m=0.5)
    scene = build_floor_plan(plan, 3, workers=1)
    bare = floor_plan_scene(plan, feature_count=1)
    assert np.array_equal(scene.locations_m, bare.locations_m) and np.array_equal(scene.graph, bare.graph)
    assert scene.headings_deg.tolist() == [0, 90, 180, 270] * 3
    assert (scene.name, scene.cell_size_m, scene.features, scene.encoder) == ("nook", 0.5, None, None)
    assert scene.observations.shape == (12, 300, 400, 3)
    assert len({picture.tobytes() for picture in scene.observations}) == 12
    assert 50 < scene.observations.mean() < 180
    check_scene(scene)
    top = scene.top_view
    # the middles of the outermost cells lie 0.35 m from the walls, or another 0.5 m of furniture away
    for near, far in ((2.0 - top.x_min_m, top.x_max_m - 2.5), (-1.0 - top.z_min_m, top.z_max_m + 0.5)):
        assert sorted((round(near, 2), round(far, 2))) in ([0.35, 0.85], [0.85, 0.85])
    assert (scene.made_by.source, scene.made_by.room, scene.made_by.seed) == ("floor_plan", None, 3)
    assert set(scene.made_by.versions) == {"clearway", "mujoco", "numpy", "scipy"}


@pytest.mark.slow
def test_the_default_bathroom_has_the_states_of_the_paper():
    scene = build_scene("bathroom")
    assert scene.state_count == 180
    assert len({picture.tobytes() for picture in scene.observations}) == 180
    brightness = scene.observations[:].mean()
    assert 85 < brightness < 155
    assert scene.top_view.image.mean() > 40
