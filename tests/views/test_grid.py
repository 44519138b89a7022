"""Takes of a grid are of its poses, each perturbed in its own way; once taken they are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import ArgumentError, SceneError
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.live.conditions import REFERENCE, Perturbations
from clearway.rooms.camera import first_person_shot
from clearway.rooms.detail import DETAIL_NOTE
from clearway.rooms.render import render
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.views import grid
from clearway.views.grid import grid_settings, grid_takes, placed_takes, take_grid
from helpers.made import corridor_scene
from helpers.made_files import in_this_process

LIGHT = Perturbations(light=0.5, pixel_noise=5.0)


def asked(live, perturbations, takes=3, seed=0):
    return grid_settings(live.scene, perturbations, takes, seed)


@pytest.fixture
def _here(live, monkeypatch):
    """Rendering in a process that has loaded PyTorch, as this one has, may crash."""

    def render_in_a_process(*given, here: bool):
        assert here
        return render(*given, workers=1)

    monkeypatch.setattr(grid, "live_room", lambda scene, **options: live)
    monkeypatch.setattr(grid, "render", render_in_a_process)


@pytest.mark.slow
@pytest.mark.usefixtures("_here")
def test_unperturbed_takes_are_the_scene_s_own_pictures_and_light_and_noise_are_those_of_the_draws(live):
    own = live.scene.observations
    plain = take_grid(live.scene, asked(live, Perturbations(), takes=1))
    np.testing.assert_array_equal(plain[:, 0], own)
    seen = take_grid(live.scene, asked(live, LIGHT))
    assert seen.shape == (len(own), 3, *own.shape[1:])
    draws = [one.draws for one in placed_takes(live, asked(live, LIGHT))]
    assert len({one.brightness for one in draws}) == seen.shape[0] * 3
    for state in (0, 7, len(own) - 1):
        for take in range(3):
            np.testing.assert_array_equal(seen[state, take], draws[3 * state + take].seen(own[state]))


def test_a_take_is_near_its_pose_where_the_body_is_free_with_the_furniture_as_it_stands(live):
    settings = asked(live, REFERENCE, takes=4)
    bodies: dict[int, object] = {}
    for number, one in enumerate(placed_takes(live, settings)):
        x_m, z_m, heading_deg = live.pose_of(number // 4)
        turned_deg = (one.pose[2] - heading_deg + 180) % 360 - 180
        assert abs(one.pose[0] - x_m) <= 0.25 and abs(one.pose[1] - z_m) <= 0.25 and abs(turned_deg) < 25
        if one.layout == 0:  # where a piece stands in its way
            assert one.pose == (x_m, z_m, heading_deg)
        assert one.shot == first_person_shot(
            *one.pose, height_m=one.height_m, pitch_deg=one.pitch_deg, moved_m=one.shot.moved_m
        )
        bodies.setdefault(one.layout, one.shot.moved_m)
        assert one.shot.moved_m == bodies[one.layout]
    assert len(bodies) == 5 and len(set(bodies.values())) == 5


def test_takes_differ_in_each_perturbation_and_follow_from_seed_and_state(live):
    placed = placed_takes(live, asked(live, REFERENCE, takes=4))
    for values in ([one.height_m for one in placed], [one.pitch_deg for one in placed]):
        assert len(set(values)) == len(placed)
    layouts = np.array([one.layout for one in placed]).reshape(-1, 4)
    assert all(len(set(row[row > 0])) == (row > 0).sum() for row in layouts)
    assert placed_takes(live, asked(live, REFERENCE, takes=4)) == placed
    other = placed_takes(live, asked(live, REFERENCE, takes=4, seed=1))
    assert all(one.height_m != two.height_m for one, two in zip(placed, other, strict=True))


def test_parts_of_the_scene_that_cannot_be_reached_are_perturbed_too(live):
    alone = live.scene.cells == live.scene.cells.max()
    graph = live.scene.graph.copy()
    moves = graph[:, [0, 3]]
    moves[alone | (moves >= 0).any(axis=1) & np.isin(moves, np.flatnonzero(alone)).any(axis=1)] = -1
    graph[:, [0, 3]] = moves
    parted = replace(live, scene=replace(live.scene, graph=graph))
    assert set(parted.scene.components[alone]) != {0}
    placed = placed_takes(parted, asked(parted, Perturbations(distance_noise=0.05)))
    assert all(one.pose[:2] != parted.pose_of(number // 3)[:2] for number, one in enumerate(placed))


@pytest.mark.slow
def test_takes_are_kept_and_come_in_the_order_of_their_scenes(live, tmp_path, monkeypatch):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    took: list[str] = []

    def take_made_up(scene, settings):
        took.append(scene.name)
        assert scene.observations is None and scene.features is None, "pictures are not sent to workers"
        shape = (scene.state_count, settings.takes, *settings.size_px, 3)
        return np.full(shape, len(scene.name) + settings.seed, np.uint8)

    monkeypatch.setattr(grid, "take_grid", take_made_up)
    monkeypatch.setattr(grid, "check_mujoco", lambda: None)
    monkeypatch.setattr(grid, "workers_for", in_this_process(lambda work, part: work.do(work.set_up(), part)))
    scenes = [replace(live.scene, name=name) for name in ("a", "bb", "ccc")]
    told: list[int] = []
    for _ in range(2):
        values = [int(one[0, 0, 0, 0, 0]) for one in grid_takes(scenes, LIGHT, takes=2, workers=1, done=told.append)]
        assert values == [1, 2, 3] and took == ["a", "bb", "ccc"]
    assert told == [1, 2, 3] * 2
    for changed in ({"seed": 1}, {"takes": 3}, {"perturbations": REFERENCE}):
        list(grid_takes(scenes[:1], **{"perturbations": LIGHT, "takes": 2, "workers": 1, **changed}))
    assert took[3:] == ["a"] * 3


def test_what_cannot_be_taken_is_told_before_anything_is(live):
    with pytest.raises(SceneError, match="corridor: there is no room to walk in: the scene comes from test"):
        next(grid_takes([live.scene, corridor_scene()], LIGHT, takes=2))
    with pytest.raises(SceneError, match="walkable: has no pictures"):
        next(grid_takes([replace(live.scene, observations=None)], LIGHT, takes=2))
    with pytest.raises(ArgumentError, match="takes=101: expected 1 to 100"):
        next(grid_takes([live.scene], LIGHT, takes=101))
    with pytest.raises(SceneError, match="nothing can be moved in a MuJoCo model, and move_furniture is asked for"):
        placed_takes(replace(live, room=None), asked(live, REFERENCE))


@pytest.mark.slow
def test_a_room_is_built_and_taken_in_a_worker_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    numbers = range(3, 40, 4)  # bathrooms
    plan = min((generated_plan(Request("room", "train", 0, n)) for n in numbers), key=lambda one: len(one.cells))
    bare = floor_plan_scene(plan, 8)
    noted = replace(bare.made_by, notes={**bare.made_by.notes, DETAIL_NOTE: "small"})
    blank = np.zeros((bare.state_count, 24, 32, 3), np.uint8)
    scene = replace(bare, observations=blank, made_by=noted)
    (seen,) = grid_takes([scene], REFERENCE, takes=2, workers=1)
    assert seen.shape == (scene.state_count, 2, 24, 32, 3) and seen.dtype == np.uint8
    assert seen.std() > 20 and np.abs(seen[:, 0].astype(int) - seen[:, 1]).mean() > 10
    (again,) = grid_takes([scene], REFERENCE, takes=2, workers=1)
    np.testing.assert_array_equal(again, seen)
