"""MuJoCo models as scenes: what is seen from where, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers import mjcf as importer
from clearway.importers import picture_limits
from clearway.importers.mjcf import read_mjcf
from clearway.importers.mjcf_floor import FloorChoice
from clearway.rooms.obstacles import AgentShape
from clearway.scenes.actions import Action
from clearway.scenes.validate import pose_quirks

RED, GREEN = (0.9, 0.1, 0.1), (0.1, 0.9, 0.1)
BRIGHT = '<visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>'
WORLD = f"""<mujoco>{BRIGHT}<worldbody>
  <geom type="plane" size="0 0 1" rgba=".5 .5 .5 1" pos="0 0 2"/>
  <geom type="box" size=".1 .1 .5" pos="1 3 2.5" rgba=".9 .1 .1 1"/>
  <geom type="box" size="2 4 .1" pos="0 0 5" rgba=".2 .2 .9 1"/>
  <geom type="box" size=".1 .1 .2" pos="-1 -3 2.2" rgba=".1 .9 .1 1"/>
</worldbody></mujoco>"""  # a floor at 2 m, a red post ahead on the right, a green one behind on the left, a ceiling


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "posts.xml"
    path.write_text(WORLD)
    return path


def columns_of(picture: np.ndarray, rgb: tuple[float, float, float]) -> np.ndarray:
    """The columns in which a colour is seen."""
    return np.flatnonzero((np.abs(picture - 255 * np.array(rgb)).max(axis=2) < 12).any(axis=0))


@pytest.mark.slow
def test_the_world_is_seen_the_right_way_round(path: Path) -> None:
    world = FloorChoice(floor_m=2.0, camera_m=0.8, extent_m=(-1.3, 1.3, -3.3, 3.3), spawn_m=(0.0, 0.0))
    scene = read_mjcf(
        path, world, AgentShape(step_m=1.0), height_px=60, width_px=80, sensors=("rgb", "depth"), workers=1
    )
    assert pose_quirks(scene) == []
    assert scene.cell_count == 3 * 7 - 2
    here = int(np.flatnonzero(np.all(np.abs(scene.locations_m) < 1e-9, axis=1))[0])
    ahead, right, behind, left = (scene.observations[here + turn] for turn in range(4))
    red = columns_of(ahead, RED)
    middle = 40 + 30 / np.tan(np.radians(30)) * 1 / 3  # 1 m to the right at 3 m
    assert red.size and abs(red.mean() - middle) < 3
    depth_m = scene.seen_by("depth")[here]
    np.testing.assert_allclose(depth_m[30, red[1:-1]], 2.9, atol=0.002)  # to the front of the post
    assert depth_m[30, :10].min() == 20  # the model has no walls
    green = columns_of(behind, GREEN)
    assert green.size and green.min() > 40  # behind on the left is on the right when one looks back
    assert not any(columns_of(side, colour).size for side in (left, right) for colour in (RED, GREEN))
    assert scene.locations_m[scene.graph[here, Action.MOVE_FORWARD]].tolist() == [0.0, 1.0]
    assert scene.locations_m[scene.graph[here + 1, Action.MOVE_FORWARD]].tolist() == [1.0, 0.0]

    view = scene.top_view
    assert view is not None
    height, width, _ = view.image.shape
    spot = {
        colour: view.image[round((view.z_max_m - z) * height / 6.6), round((x - view.x_min_m) * width / 2.6)]
        for colour, x, z in ((RED, 1.0, 3.0), (GREEN, -1.0, -3.0))
    }  # under the ceiling, which is not drawn
    for colour, pixel in spot.items():
        np.testing.assert_allclose(pixel, 255 * np.array(colour), atol=12)
    assert (scene.name, scene.made_by.source, scene.cell_size_m) == ("posts", "mjcf", 1.0)
    assert scene.made_by.notes["file"] == "posts.xml"


@pytest.mark.slow
def test_hidden_geoms_and_limits_of_the_model_s_own_hide_nothing(path: Path) -> None:
    hidden = '<geom type="box" size=".15 .15 .6" pos="1 3 2.5" group="3"/>'  # around the red post, to collide with
    far = '<statistic extent="200"/>'  # MuJoCo would draw nothing nearer than a hundredth of it
    path.write_text(WORLD.replace("</worldbody>", f"{hidden}</worldbody>{far}"))
    world = FloorChoice(floor_m=2.0, camera_m=0.8, extent_m=(0.7, 1.3, 0.7, 3.3), spawn_m=(1.0, 2.0))
    scene = read_mjcf(path, world, AgentShape(step_m=1.0), height_px=30, width_px=40, workers=1)
    assert scene.locations_m[::4].tolist() == [[1.0, 1.0], [1.0, 2.0]]
    assert 20 in columns_of(scene.observations[4], RED)
    assert scene.top_view is not None
    assert columns_of(scene.top_view.image, RED).size


@pytest.mark.slow
def test_more_than_fits_is_refused_before_any_picture_is_taken(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importer, "sense", lambda *_, **__: pytest.fail("rendered"))
    monkeypatch.setattr(picture_limits, "MAX_PICTURE_BYTES", 20 << 20)
    problem = r"\d+ pictures of 400 x 300 pixels take \d+ MiB of memory, expected at most 20\. .*--step"
    with pytest.raises(SceneError, match=problem):
        read_mjcf(path, FloorChoice(floor_m=2.0))
    monkeypatch.setattr(picture_limits, "MAX_STATES", 8)
    with pytest.raises(SceneError, match=r"has \d+ poses on free cells, expected at most 8\. .*--step"):
        read_mjcf(path, FloorChoice(floor_m=2.0), height_px=30, width_px=40)


def test_bodies_and_pictures_that_cannot_be_are_refused(path: Path) -> None:
    with pytest.raises(SceneError, match=r"an agent 0\.4 m high and 0\.4 m wide is no standing capsule"):
        read_mjcf(path, agent=AgentShape(height_m=0.4))
    with pytest.raises(SceneError, match="pictures of 0 x 300 pixels"):
        read_mjcf(path, width_px=0)
