"""The package itself, headless, on small worlds of our own; skipped where it is not installed or cannot draw."""

import sys
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers import miniworld as importer
from clearway.importers import picture_limits
from clearway.importers.miniworld import photographed, started
from clearway.scenes.actions import Action
from clearway.scenes.scene import Scene
from clearway.scenes.validate import pose_quirks

pytestmark = pytest.mark.skipif(find_spec("miniworld") is None, reason="needs the extra miniworld")
SIZE = {"height_px": 30, "width_px": 40}


def two_rooms(**words: Any) -> Any:
    """A room from x = 0 to 4, another from 4 to 8, a doorway between them; their z from 0 to 3, ours from -3 to 0.

    A red box stands in the first room's corner of large x and our large z; a blue one in the second, between cells.
    """
    from miniworld.entity import Box
    from miniworld.miniworld import MiniWorldEnv

    class TwoRooms(MiniWorldEnv):
        def _gen_world(self) -> None:
            first = self.add_rect_room(min_x=0, max_x=4, min_z=0, max_z=3, wall_tex="concrete")
            second = self.add_rect_room(min_x=4, max_x=8, min_z=0, max_z=3, wall_tex="concrete")
            self.connect_rooms(first, second, min_z=1, max_z=2)
            self.place_entity(Box(color="red", size=0.5), pos=np.array([3.5, 0, 0.5]), dir=0)
            self.place_entity(Box(color="blue", size=0.1), pos=np.array([6.5, 0, 1.0]), dir=0)
            self.place_entity(self.agent, pos=np.array([0.5, 0, 0.5]), dir=0)

    return TwoRooms(**words)


@pytest.fixture(scope="module")
def world() -> Iterator[Any]:
    if "TwoRooms-v0" not in gymnasium.registry:
        gymnasium.register("TwoRooms-v0", two_rooms)
    try:
        with started("TwoRooms-v0") as env:
            yield env
    except SceneError as error:
        pytest.skip(f"MiniWorld does not draw here: {error}")


@pytest.fixture(scope="module")
def scene(world: Any) -> Scene:
    return photographed(world, "TwoRooms", step_m=1.0, **SIZE)


def places(scene: Scene) -> set[tuple[float, float]]:
    return {(float(x), float(z)) for x, z in scene.locations_m}


def state_at(scene: Scene, x_m: float, z_m: float, heading_deg: int) -> int:
    there = np.all(scene.locations_m == (x_m, z_m), axis=1) & (scene.headings_deg == heading_deg)
    return int(np.flatnonzero(there)[0])


def reddest_columns(picture: np.ndarray) -> np.ndarray:
    red, green, blue = picture.astype(int).transpose(2, 0, 1)
    return np.flatnonzero(((red > 2 * green) & (red > 2 * blue) & (red > 60)).any(axis=0))


def test_the_cells_and_moves_are_those_typed_in(scene: Scene) -> None:
    assert pose_quirks(scene) == []
    full = {(x + 0.5, -z - 0.5) for x in range(8) for z in range(3)}
    assert places(scene) == full - {(3.5, -0.5)}  # the red box
    blocked = {
        tuple(scene.locations_m[state]): scene.graph[state, Action.MOVE_FORWARD] == -1
        for state in range(0, scene.state_count)
        if scene.headings_deg[state] == 90 and scene.locations_m[state, 0] == 3.5
    }
    assert blocked == {(3.5, -1.5): False, (3.5, -2.5): True}  # the doorway, the wall beside it
    up = state_at(scene, 6.5, -1.5, 0)
    assert scene.graph[up, Action.MOVE_FORWARD] == -1  # the blue box stands between two free cells
    assert scene.graph[up, Action.MOVE_BACKWARD] == state_at(scene, 6.5, -2.5, 0)


def test_the_world_is_seen_the_right_way_round(scene: Scene) -> None:
    assert scene.observations is not None
    middle = SIZE["width_px"] / 2
    ahead_on_the_right = scene.observations[state_at(scene, 2.5, -2.5, 0)]
    assert reddest_columns(ahead_on_the_right).size and reddest_columns(ahead_on_the_right).min() >= middle
    ahead_on_the_left = scene.observations[state_at(scene, 1.5, -1.5, 90)]
    assert reddest_columns(ahead_on_the_left).size and reddest_columns(ahead_on_the_left).max() < middle
    assert not reddest_columns(scene.observations[state_at(scene, 1.5, -1.5, 180)]).size
    assert not reddest_columns(scene.observations[state_at(scene, 1.5, -1.5, 270)]).size


def test_the_view_from_above_lies_where_the_world_does(scene: Scene) -> None:
    view = scene.top_view
    assert view is not None
    height, width, _ = view.image.shape
    red = np.array([reddest_columns(row[None]).size > 0 for row in view.image])
    rows, columns = np.flatnonzero(red), reddest_columns(view.image)
    x_m = view.x_min_m + (columns.mean() + 0.5) / width * (view.x_max_m - view.x_min_m)
    z_m = view.z_max_m - (rows.mean() + 0.5) / height * (view.z_max_m - view.z_min_m)
    assert (x_m, z_m) == (pytest.approx(3.5, abs=0.03), pytest.approx(-0.5, abs=0.03))


def test_the_scene_says_what_made_it(scene: Scene) -> None:
    assert (scene.made_by.source, scene.made_by.room, scene.made_by.seed) == ("miniworld", "TwoRooms", 0)
    assert set(scene.made_by.versions) == {"clearway", "miniworld", "pyglet"}
    assert scene.cell_size_m == 1.0 and scene.turn_deg == 90


def test_what_does_not_fit_is_refused_before_any_picture(world: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importer, "_pictures", lambda *_: pytest.fail("photographed"))
    with pytest.raises(SceneError, match="has 240,000 places to try, expected at most 65,536"):
        photographed(world, "TwoRooms", step_m=0.01, **SIZE)
    with pytest.raises(SceneError, match="has inf places to try"):
        photographed(world, "TwoRooms", step_m=5e-324, **SIZE)
    with pytest.raises(SceneError, match=r"radius of 0\.4 m fits nowhere on a grid of 10 m"):
        photographed(world, "TwoRooms", step_m=10.0, **SIZE)
    monkeypatch.setattr(picture_limits, "MAX_STATES", 8)
    with pytest.raises(SceneError, match=r"has 92 poses on free cells, expected at most 8\. Give a larger --step"):
        photographed(world, "TwoRooms", step_m=1.0, **SIZE)


def test_a_name_that_is_none_or_no_miniworld_is_said() -> None:
    with (
        pytest.raises(SceneError, match="MiniWorld-Nowhere-v0: there is no such environment"),
        started("MiniWorld-Nowhere-v0"),
    ):
        pytest.fail("started")
    with pytest.raises(SceneError, match="CartPole-v1: is no environment of MiniWorld"), started("CartPole-v1"):
        pytest.fail("started")


def test_without_the_package_its_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "miniworld.miniworld", None)
    with pytest.raises(SceneError, match=r"-m pip install '/.*\[miniworld\]'"), started("MiniWorld-Hallway-v0"):
        pytest.fail("started")
