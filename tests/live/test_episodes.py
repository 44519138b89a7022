"""Live episodes in a small room: the grid's without perturbations, and each perturbation does what it says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.policies import random_policy, shortest_path_policy
from clearway.live.episodes import LivePolicy, LiveProtocol, LiveTable, run_live_episodes
from clearway.live.settings import MOST, Perturbations
from clearway.perception.encode import encoder_from_record
from clearway.perception.encoder import Encoder
from clearway.rooms.camera import eye_view, first_person_shot
from clearway.rooms.render import Camera, studio
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.tables import World, make_world
from helpers.small_live import state_at

PROTOCOL = LiveProtocol(episodes_per_target=4, step_cap=15, seed=3, selection="sampled", history_length=4)


@pytest.fixture(scope="module")
def camera(live) -> Iterator[Camera]:
    with studio(live.model, eye_view(), workers=1) as opened:
        yield opened


@pytest.fixture(scope="module")
def world(live) -> World:
    targets = (state_at(live.scene, 1.75, 1.75, 0), state_at(live.scene, 0.25, 1.25, 90))
    return make_world([live.scene], {live.scene.name: targets})


def guided(world: World) -> LivePolicy:
    """Recognises the pose by its features and goes the shortest path from there."""
    to_target = shortest_path_policy(world)
    features = world.features
    assert features is not None

    def probabilities(history: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
        states = torch.cdist(history.flatten(0, 1), features).argmin(1).view(len(history), -1)
        wanted = torch.cdist(target, features[world.target_state]).argmin(1)
        return to_target(states, wanted)

    return probabilities


def uniform(history: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    return torch.full((len(target), ACTION_COUNT), 1 / ACTION_COUNT)


def walked(live, world, camera, policy: LivePolicy, protocol: LiveProtocol = PROTOCOL, **changes: float) -> LiveTable:
    encoder = encoder_from_record(live.scene.encoder)
    return run_live_episodes(live, world, policy, encoder, camera, Perturbations(**changes), protocol)


def test_without_perturbations_the_pictures_are_those_of_the_grid(live, camera):
    states = range(0, live.scene.state_count, 7)
    shots = [first_person_shot(*live.scene.locations_m[s], live.scene.headings_deg[s]) for s in states]
    np.testing.assert_array_equal(camera(shots), live.scene.observations[np.array(states)])


def test_without_perturbations_episodes_are_those_of_the_grid(live, world, camera):
    table = walked(live, world, camera, guided(world))
    grid = run_episodes(world, shortest_path_policy(world), episodes_per_target=4, step_cap=15, seed=3, record=True)
    assert table.target.tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
    assert table.steps.tolist() == grid.steps.tolist() == table.shortest_path_steps.tolist()
    assert table.start.tolist() == grid.start.tolist()
    assert table.reached.all() and not table.contacts.any() and not table.changed.any()
    scene = live.scene
    for walk, trajectory in zip(table.walks, grid.trajectories, strict=True):
        np.testing.assert_allclose(walk[:, :2], scene.locations_m[trajectory.states], atol=1e-9)
        np.testing.assert_array_equal(walk[:, 2], scene.headings_deg[trajectory.states])


@pytest.fixture(scope="module")
def random_walk(live, world, camera) -> LiveTable:
    return walked(live, world, camera, uniform)


def test_a_random_walk_is_the_grids_up_to_its_first_contact(live, world, random_walk):
    table = random_walk
    grid = run_episodes(world, random_policy(), episodes_per_target=4, step_cap=15, seed=3, record=True)
    blocked = [np.flatnonzero(t.states[1:] == t.states[:-1]) for t in grid.trajectories]
    assert sum(len(steps) > 0 for steps in blocked) >= 4
    assert (table.contacts > 0).tolist() == [len(steps) > 0 for steps in blocked]
    for walk, trajectory, steps in zip(table.walks, grid.trajectories, blocked, strict=True):
        same = 1 + (steps[0] if len(steps) else len(trajectory.actions))
        places_m = live.scene.locations_m[trajectory.states[:same]]
        np.testing.assert_allclose(walk[:same, :2], places_m, atol=1e-9)


def test_clearance_is_zero_exactly_where_there_was_a_contact(random_walk):
    table = random_walk
    assert ((table.least_gap_m == 0) == (table.contacts > 0)).all()
    assert (table.close_s <= table.near_s).all() and (table.near_s <= table.steps).all()
    assert table.least_gap_m.max() < 0.3 and (table.mean_gap_m > table.least_gap_m).all()


def test_argmax_takes_the_most_probable_action(live, world, camera):
    def turning(history: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
        return torch.tensor([[0.3, 0.4, 0.2, 0.1]]).repeat(len(target), 1)

    protocol = replace(PROTOCOL, episodes_per_target=1, step_cap=3, selection="argmax")
    table = walked(live, world, camera, turning, protocol)
    for walk in table.walks:
        assert (np.diff(walk[:, 2]) % 360 == 90).all()


class Looking:
    """An encoder that keeps the pictures that it sees."""

    def __init__(self, encoder: Encoder) -> None:
        self.encoder, self.seen = encoder, []

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        self.seen.append(pictures.copy())
        return self.encoder.encode(pictures)


def first_pictures(live, world, camera, **changes: float) -> np.ndarray:
    """What two episodes see at their start, (2, height, width, 3)."""
    looking = Looking(encoder_from_record(live.scene.encoder))
    protocol = replace(PROTOCOL, episodes_per_target=1, step_cap=1)
    run_live_episodes(live, world, uniform, looking, camera, Perturbations(**changes), protocol)
    return looking.seen[0].astype(int)


CHANGES_OF_PICTURES = {"light": 0.3, "pixel_noise": 10.0, "camera_height_jitter": 0.05, "camera_pitch_jitter": 3.0}


@pytest.mark.parametrize("name", CHANGES_OF_PICTURES)
def test_each_perturbation_of_the_camera_alone_changes_what_the_encoder_sees(live, world, camera, name) -> None:
    plain = first_pictures(live, world, camera)
    np.testing.assert_array_equal(first_pictures(live, world, camera), plain)
    changed = first_pictures(live, world, camera, **{name: CHANGES_OF_PICTURES[name]})
    assert (np.abs(changed - plain).mean(axis=(1, 2, 3)) > 0.1).all()


def forwards(history: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    return torch.eye(ACTION_COUNT)[:1].repeat(len(target), 1)


def to_the_right(history: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    return torch.eye(ACTION_COUNT)[1:2].repeat(len(target), 1)


def test_distance_noise_changes_moves_and_angle_noise_turns(live, world, camera):
    protocol = replace(PROTOCOL, step_cap=1)
    moved = walked(live, world, camera, forwards, protocol, distance_noise=0.05)
    lengths_m = [np.linalg.norm(walk[1, :2] - walk[0, :2]) for walk in moved.walks]
    free = np.array(lengths_m)[moved.contacts == 0]
    assert len(free) >= 3
    assert 0 < np.abs(free - 0.5).max() < 0.25 and len(set(free)) == len(free)
    turned = walked(live, world, camera, to_the_right, protocol, angle_noise=5.0)
    angles_deg = np.array([(walk[1, 2] - walk[0, 2]) % 360 for walk in turned.walks])
    assert 0 < np.abs(angles_deg - 90).max() < 25 and len(set(angles_deg)) == 8


def test_furniture_moves_by_no_more_than_it_may_and_into_nothing(live, world, camera):
    protocol = replace(PROTOCOL, step_cap=1)
    table = walked(live, world, camera, to_the_right, protocol, move_furniture=0.3)
    assert table.changed.all()
    distances_m = [np.hypot(*offset) for layout in table.layouts for offset in layout.moved_m]
    assert max(distances_m) <= 0.3
    assert len({layout.moved_m for layout in table.layouts}) == 8


def test_perturbations_at_their_most_can_be_walked(live, world, camera):
    table = walked(live, world, camera, uniform, replace(PROTOCOL, step_cap=3), **MOST)
    width_m, depth_m = live.room.width_m, live.room.depth_m
    for walk in table.walks:
        assert ((walk[:, :2] >= 0) & (walk[:, :2] <= (width_m, depth_m))).all()


def test_an_episode_draws_the_same_whatever_else_is_perturbed(live, world, camera):
    protocol = replace(PROTOCOL, step_cap=2)
    alone = walked(live, world, camera, forwards, protocol, distance_noise=0.05)
    again = walked(live, world, camera, forwards, protocol, distance_noise=0.05)
    beside = walked(live, world, camera, forwards, protocol, distance_noise=0.05, pixel_noise=20.0, light=0.3)
    other = walked(live, world, camera, forwards, replace(protocol, seed=4), distance_noise=0.05)
    for first, second, third in zip(alone.walks, again.walks, beside.walks, strict=True):
        np.testing.assert_array_equal(first, second)
        np.testing.assert_array_equal(first, third)
    assert any(len(a) != len(b) or (a != b).any() for a, b in zip(alone.walks, other.walks, strict=True))
