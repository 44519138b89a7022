"""MuJoCo models of others to walk in: the grid's moves, the floor's edges and holes, what is missing or changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from clearway.errors import SceneError
from clearway.importers.mjcf import read_mjcf
from clearway.live.live_room import LiveRoom, live_room
from clearway.live_envs.single import LiveImageGoalEnv
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.small_model import AGENT, CHOICE, MODEL, PLANE, SLAB, written

SMALL = {"height_px": 12, "width_px": 16}


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("hall"), PLANE)


@pytest.fixture(scope="module")
def scene(hall: Path) -> Scene:
    """As it is read again from a scene file."""
    write_scene(read_mjcf(hall, CHOICE, AGENT, height_px=33, width_px=45, workers=1), hall.with_suffix(".h5"))
    return read_scene(hall.with_suffix(".h5"))


@pytest.fixture(scope="module")
def live(scene: Scene) -> LiveRoom:
    return live_room(scene)


def outcomes(live: LiveRoom) -> Iterator[tuple[bool, bool, float]]:
    """Of every move of the grid: blocked there, a contact here, and how far off it ends where it is free."""
    body = live.body(live.as_built())
    for state in range(live.scene.state_count):
        x_m, z_m, heading_deg = live.pose_of(state)
        for action, sign in ((Action.MOVE_FORWARD, 1), (Action.MOVE_BACKWARD, -1)):
            body.stand_at(np.array([x_m, z_m]))
            contact = body.move(sign * live.scene.cell_size_m, heading_deg, measured=False).contact
            to = live.scene.graph[state, action]
            off_m = 0.0 if to == BLOCKED else float(np.abs(body.place_m - live.scene.locations_m[to]).max())
            yield bool(to == BLOCKED), contact, off_m


def test_the_moves_are_those_of_the_grid(live: LiveRoom) -> None:
    found = list(outcomes(live))
    assert 20 < sum(blocked for blocked, _, _ in found) < len(found) - 20
    assert all(blocked == contact and off_m < 1e-9 for blocked, contact, off_m in found)


@pytest.mark.slow
def test_where_the_floor_ends_the_move_ends(tmp_path: Path) -> None:
    """A slab with nothing round it: the body stops before its middle is over the edge."""
    live = live_room(read_mjcf(written(tmp_path, SLAB), CHOICE, AGENT, workers=1, **SMALL))
    assert all(blocked == contact for blocked, contact, _ in outcomes(live))
    body = live.body(live.as_built())
    body.stand_at(np.array([-2.0, -1.0]))
    assert body.move(0.5, 270.0).contact
    assert body.place_m[0] == pytest.approx(-2.1, abs=0.002)


@pytest.mark.slow
def test_a_model_that_was_trusted_is_walked_in_as_long_as_its_files_are_the_same(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "more.xml").write_text("<mujoco><custom/></mujoco>")
    path = written(tmp_path / "home", SLAB)
    path.write_text(path.read_text().replace("<worldbody>", '<include file="../more.xml"/><worldbody>'))
    with pytest.raises(SceneError, match=r"lies outside its folder\. .*--trust"):
        read_mjcf(path, CHOICE, AGENT)
    scene = read_mjcf(path, CHOICE, AGENT, workers=1, trust=True, **SMALL)
    assert live_room(scene).world is not None
    (tmp_path / "more.xml").write_text("<mujoco><!-- changed --><custom/></mujoco>")
    with pytest.raises(SceneError, match=r"outside its folder have changed since it was imported"):
        live_room(scene)


def test_the_edge_of_what_counts_as_floor_is_a_wall(live: LiveRoom) -> None:
    body = live.body(live.as_built())
    body.stand_at(np.array([-2.0, -1.0]))
    assert body.move(0.5, 270.0).contact
    assert body.place_m[0] == pytest.approx(-2.3, abs=0.002)  # 2.5 m less the radius


def test_clearance_is_that_to_meshes_and_moving_bodies_too(live: LiveRoom) -> None:
    body = live.body(live.as_built())
    body.stand_at(np.array([-0.5, 1.0]))
    assert body.gap_m() == pytest.approx(0.2)  # to the wall: 0.4 m less the radius
    body.stand_at(np.array([0.9, 1.5]))
    assert body.gap_m() == pytest.approx(0.2 - 0.2, abs=1e-6)  # to the spike's edge along z
    body.stand_at(np.array([-1.0, 2.0]))
    assert body.gap_m() == pytest.approx(0.7 - 0.25 - 0.2, abs=1e-6)  # to the barrel
    body.stand_at(np.array([-1.5, -1.5]))
    assert not body.touches and body.gap_m() == pytest.approx(0.8)  # in what is only seen, from the edge


def test_two_bodies_in_one_model_are_two(live: LiveRoom) -> None:
    one, other = live.body(live.as_built()), live.body(live.as_built())
    one.stand_at(np.array([-0.5, 1.0]))
    other.stand_at(np.array([-1.5, -1.5]))
    assert one.gap_m() == pytest.approx(0.2) and other.gap_m() == pytest.approx(0.8)


@pytest.mark.slow
def test_an_environment_sees_the_scene_s_pictures_there(scene: Scene) -> None:
    env = LiveImageGoalEnv(scene, height_px=33, width_px=45)
    seen, info = env.reset(seed=0, options={"start": 5, "target": 9})
    assert (info["x_m"], info["z_m"]) == tuple(scene.locations_m[5])
    for key, state in (("observation", 5), ("target", 9)):
        np.testing.assert_array_equal(seen[key], scene.observations[state])  # whatever was seen before
        assert np.abs(seen[key].astype(int) - scene.observations[state + 1]).max() > 100
    env.close()


@pytest.mark.slow
def test_gymnasiums_own_check_finds_nothing(scene: Scene) -> None:
    noisy = {"distance_noise": 0.05, "camera_height_jitter": 0.1, "light": 0.3, "pixel_noise": 5.0}
    env = LiveImageGoalEnv(scene, perturbations=noisy, sensors=("rgb", "depth", "clearance"), stop=True, **SMALL)
    check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.slow
def test_a_model_s_file_is_a_room_by_itself(hall: Path) -> None:
    flat = hall.with_name("flat.xml")
    flat.write_text(MODEL.format(**PLANE).replace('pos="0 0 1"', 'pos="0 0 0"'))
    env = LiveImageGoalEnv(str(flat), **SMALL)
    assert env.scene_names == ("flat",)
    seen, _ = env.reset(seed=0)
    assert env.observation_space.contains(seen) and len(np.unique(seen["observation"])) > 1
    env.close()


@pytest.mark.parametrize("name", ["move_furniture", "new_obstacle"])
def test_what_moves_things_is_refused_in_a_line(scene: Scene, name: str) -> None:
    with pytest.raises(SceneError, match=f"^hall: nothing can be moved in a MuJoCo model, and {name} [^\n]*Leave out"):
        LiveImageGoalEnv(scene, perturbations={name: True if name == "new_obstacle" else 0.2}, **SMALL)


@pytest.mark.slow
def test_a_missing_or_changed_model_is_one_line(scene: Scene, hall: Path, tmp_path: Path) -> None:
    def moved_to(path: Path) -> Scene:
        return replace(scene, made_by=replace(scene.made_by, notes={**scene.made_by.notes, "path": str(path)}))

    with pytest.raises(SceneError, match=r"hall: its MuJoCo model /none/hall\.xml is missing\. Put it back there, or"):
        live_room(moved_to(Path("/none/hall.xml")))
    copied = written(tmp_path, PLANE)
    live_room(moved_to(copied))  # the same elsewhere
    changes = [('rgba=".9 .1 .1 1"', 'rgba=".9 .1 .2 1"'), ('pos="0 1.9 2"', 'pos="0.5 1.9 2"'), ("1 1 1", "1 1 .9")]
    for change in changes:
        copied.write_text(hall.read_text().replace(*change))
        with pytest.raises(SceneError, match=r"hall\.xml has changed since it was imported\. Import the model again"):
            live_room(moved_to(copied))


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("path", None, "does not say where its MuJoCo model lies"),
        ("digest", 3, "does not say where its MuJoCo model lies"),
        ("agent", {}, "model's agent is damaged"),
        ("agent", {"radius_m": "wide"}, "model's agent is damaged"),
        ("world", {"spawn_m": [1.0]}, "model's world is damaged"),
        ("world", {"extent_m": "all"}, "model's world is damaged"),
        ("world", {"floor_m": 10**400}, "model's world is damaged"),
        ("world", {"floor_m": 1e300}, "model's world is damaged"),
        ("world", {"floor_m": float("nan")}, "model's world is damaged"),
        ("world", {"unfelt_too": 1}, "model's world is damaged"),
    ],
)
def test_a_damaged_record_is_one_line(scene: Scene, name: str, value: object, problem: str) -> None:
    kept = scene.made_by.notes[name]
    new = {**kept, **value} if isinstance(kept, dict) and value else value
    with pytest.raises(SceneError, match=problem):
        live_room(replace(scene, made_by=replace(scene.made_by, notes={**scene.made_by.notes, name: new})))
