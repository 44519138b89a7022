"""Live episodes in a small room: the grid's without perturbations, and each perturbation does what it says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from clearway.agents.agent import FEATURES, POSE, Agent, Decisions, Observation, State
from clearway.agents.by_pose import PoseAgent, RandomWalk, shortest_paths
from clearway.errors import AgentError
from clearway.evaluation.episodes import run_episodes
from clearway.live.conditions import MOST, Perturbations
from clearway.live.draws import Draws
from clearway.live.episodes import LiveProtocol, LiveTable, Walking, run_live_episodes
from clearway.live.live_room import live_room
from clearway.perception.encode import encoder_from_record
from clearway.perception.encoder import Encoder
from clearway.rooms.camera import eye_view, first_person_shot
from clearway.rooms.render import Camera, studio
from clearway.scenes.actions import Action
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.sensors import RGB
from clearway.world.world import World, make_world
from helpers.agents import alike, by_rule, only
from helpers.small_live import state_at

PROTOCOL = LiveProtocol(episodes_per_target=4, step_limit=15, seed=3, selection="sampled")


@pytest.fixture(scope="module")
def camera(live) -> Iterator[Camera]:
    with studio(live.model, eye_view(), workers=1) as opened:
        yield opened


@pytest.fixture(scope="module")
def world(live) -> World:
    targets = (state_at(live.scene, 1.75, 1.75, 0), state_at(live.scene, 0.25, 1.25, 90))
    return make_world([live.scene], {live.scene.name: targets})


class ByPictures:
    """Recognises poses by the features of colour pictures, and leaves the rest to an agent that knows its pose."""

    sees = (RGB,)

    def __init__(self, agent: PoseAgent, world: World, encoder: Encoder) -> None:
        self.agent, self.encoder = agent, encoder
        self.features, self.goals = world.features.numpy(), world.target_state.numpy()
        self.seen: list[np.ndarray] = []

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        wanted = self._nearest(target[FEATURES], self.features[self.goals])
        return self.agent.reset({POSE: self.goals[wanted]}, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        assert tuple(observation) == self.sees
        self.seen.append(observation[RGB].copy())
        poses = self._nearest(self.encoder.encode(observation[RGB]), self.features)
        return self.agent.act({POSE: poses}, state)

    def _nearest(self, features: np.ndarray, known: np.ndarray) -> np.ndarray:
        return np.linalg.norm(features[:, None] - known, axis=2).argmin(1)


def by_pictures(live, agent: PoseAgent, world: World) -> ByPictures:
    assert live.scene.encoder is not None
    return ByPictures(agent, world, encoder_from_record(live.scene.encoder))


def walked(live, world, camera, agent: Agent, protocol: LiveProtocol = PROTOCOL, **changes: float) -> LiveTable:
    return run_live_episodes(live, world, agent, camera, Perturbations(**changes), protocol)


def test_without_perturbations_the_pictures_are_those_of_the_grid(live, camera):
    states = range(0, live.scene.state_count, 7)
    shots = [first_person_shot(*live.scene.locations_m[s], live.scene.headings_deg[s]) for s in states]
    np.testing.assert_array_equal(camera(shots), live.scene.observations[np.array(states)])


def test_without_perturbations_episodes_are_those_of_the_grid(live, world, camera):
    table = walked(live, world, camera, by_pictures(live, shortest_paths(world), world))
    grid = run_episodes(world, shortest_paths(world), episodes_per_target=4, step_limit=15, seed=3, record=True)
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
    return walked(live, world, camera, RandomWalk())


def test_a_random_walk_is_the_grids_up_to_its_first_contact(live, world, random_walk):
    table = random_walk
    grid = run_episodes(world, RandomWalk(), episodes_per_target=4, step_limit=15, seed=3, record=True)
    blocked = [np.flatnonzero(t.states[1:] == t.states[:-1]) for t in grid.trajectories]
    assert sum(len(steps) > 0 for steps in blocked) >= 4
    assert (table.contacts > 0).tolist() == [len(steps) > 0 for steps in blocked]
    for walk, trajectory, steps in zip(table.walks, grid.trajectories, blocked, strict=True):
        same = 1 + (steps[0] if len(steps) else len(trajectory.actions))
        places_m = live.scene.locations_m[trajectory.states[:same]]
        np.testing.assert_allclose(walk[:same, :2], places_m, atol=1e-9)


@pytest.mark.slow
def test_in_a_floor_plan_a_random_walk_is_the_plans_up_to_its_first_contact():
    reachable = np.ones((4, 3), bool)
    reachable[1, 1] = False
    scene = floor_plan_scene(FloorPlan.of_map("ring", reachable, cell_size_m=0.5), feature_count=4)
    live, world = live_room(scene), make_world([scene], {"ring": (0, 22)})
    table = run_live_episodes(live, world, RandomWalk(), unused, Perturbations(), PROTOCOL)
    grid = run_episodes(world, RandomWalk(), episodes_per_target=4, step_limit=15, seed=3, record=True)
    blocked = [np.flatnonzero(t.states[1:] == t.states[:-1]) for t in grid.trajectories]
    assert table.contacts.any() and (table.contacts > 0).tolist() == [len(steps) > 0 for steps in blocked]
    for walk, trajectory, steps in zip(table.walks, grid.trajectories, blocked, strict=True):
        same = 1 + (steps[0] if len(steps) else len(trajectory.actions))
        places_m = scene.locations_m[trajectory.states[:same]]
        np.testing.assert_allclose(walk[:same, :2] + live.origin_m, places_m, atol=1e-9)


@pytest.mark.parametrize(("cell_size_m", "reached_m"), [(0.2, 0.1), (0.25, 0.125), (0.5, 0.25), (1.0, 0.25)])
def test_a_neighbouring_cell_is_not_the_target(live, cell_size_m, reached_m):
    room = replace(live, scene=replace(live.scene, cell_size_m=cell_size_m))
    target = state_at(live.scene, 1.25, 1.25, 0)
    walking = Walking(room, state_at(live.scene, 0.25, 0.25, 0), target, Draws(0, Perturbations()))
    for apart_m, reached in ((reached_m - 0.01, True), (reached_m + 0.01, False)):
        walking.walker.body.stand_at(np.array([1.25, 1.25 + apart_m]))
        assert walking.reached is reached


def unused(shots):
    raise AssertionError("nobody looks")


def test_clearance_is_zero_exactly_where_there_was_a_contact(random_walk):
    table = random_walk
    assert ((table.least_gap_m == 0) == (table.contacts > 0)).all()
    assert (table.close_s <= table.near_s).all() and (table.near_s <= table.steps).all()
    assert table.least_gap_m.max() < 0.3 and (table.mean_gap_m > table.least_gap_m).all()


def test_argmax_takes_the_most_probable_action(live, world, camera):
    turning = by_pictures(live, by_rule(world, alike(0.3, 0.4, 0.2, 0.1)), world)
    protocol = replace(PROTOCOL, episodes_per_target=1, step_limit=3, selection="argmax")
    table = walked(live, world, camera, turning, protocol)
    for walk in table.walks:
        assert (np.diff(walk[:, 2]) % 360 == 90).all()


def first_pictures(live, world, camera, **changes: float) -> np.ndarray:
    """What two episodes see at their start, (2, height, width, 3)."""
    looking = by_pictures(live, by_rule(world, alike(0.25, 0.25, 0.25, 0.25)), world)
    protocol = replace(PROTOCOL, episodes_per_target=1, step_limit=1)
    walked(live, world, camera, looking, protocol, **changes)
    return looking.seen[0].astype(int)


CHANGES_OF_PICTURES = {"light": 0.3, "pixel_noise": 10.0, "camera_height_jitter": 0.05, "camera_pitch_jitter": 3.0}


@pytest.mark.parametrize("name", CHANGES_OF_PICTURES)
def test_each_perturbation_of_the_camera_alone_changes_what_the_agent_sees(live, world, camera, name) -> None:
    plain = first_pictures(live, world, camera)
    np.testing.assert_array_equal(first_pictures(live, world, camera), plain)
    changed = first_pictures(live, world, camera, **{name: CHANGES_OF_PICTURES[name]})
    assert (np.abs(changed - plain).mean(axis=(1, 2, 3)) > 0.1).all()


def forwards(live, world: World) -> Agent:
    return by_pictures(live, by_rule(world, only(Action.MOVE_FORWARD)), world)


def to_the_right(live, world: World) -> Agent:
    return by_pictures(live, by_rule(world, only(Action.TURN_RIGHT)), world)


def test_distance_noise_changes_moves_and_angle_noise_turns(live, world, camera):
    protocol = replace(PROTOCOL, step_limit=1)
    moved = walked(live, world, camera, forwards(live, world), protocol, distance_noise=0.05)
    lengths_m = [np.linalg.norm(walk[1, :2] - walk[0, :2]) for walk in moved.walks]
    free = np.array(lengths_m)[moved.contacts == 0]
    assert len(free) >= 3
    assert 0 < np.abs(free - 0.5).max() < 0.25 and len(set(free)) == len(free)
    turned = walked(live, world, camera, to_the_right(live, world), protocol, angle_noise=5.0)
    angles_deg = np.array([(walk[1, 2] - walk[0, 2]) % 360 for walk in turned.walks])
    assert 0 < np.abs(angles_deg - 90).max() < 25 and len(set(angles_deg)) == 8


def test_furniture_moves_by_no_more_than_it_may_and_into_nothing(live, world, camera):
    protocol = replace(PROTOCOL, step_limit=1)
    table = walked(live, world, camera, to_the_right(live, world), protocol, move_furniture=0.3)
    assert table.changed.all()
    distances_m = [np.hypot(*offset) for layout in table.layouts for offset in layout.moved_m]
    assert max(distances_m) <= 0.3
    assert len({layout.moved_m for layout in table.layouts}) == 8


def test_perturbations_at_their_most_can_be_walked(live, world, camera):
    table = walked(live, world, camera, RandomWalk(), replace(PROTOCOL, step_limit=3), **MOST)
    width_m, depth_m = live.room.width_m, live.room.depth_m
    for walk in table.walks:
        assert ((walk[:, :2] >= 0) & (walk[:, :2] <= (width_m, depth_m))).all()


def test_an_episode_draws_the_same_whatever_else_is_perturbed(live, world, camera):
    protocol = replace(PROTOCOL, step_limit=2)
    alone = walked(live, world, camera, forwards(live, world), protocol, distance_noise=0.05)
    again = walked(live, world, camera, forwards(live, world), protocol, distance_noise=0.05)
    beside = walked(
        live, world, camera, forwards(live, world), protocol, distance_noise=0.05, pixel_noise=20.0, light=0.3
    )
    other = walked(live, world, camera, forwards(live, world), replace(protocol, seed=4), distance_noise=0.05)
    for first, second, third in zip(alone.walks, again.walks, beside.walks, strict=True):
        np.testing.assert_array_equal(first, second)
        np.testing.assert_array_equal(first, third)
    assert any(len(a) != len(b) or (a != b).any() for a, b in zip(alone.walks, other.walks, strict=True))


class Poseless(RandomWalk):
    """Wants more than a camera gives."""

    sees = (RGB, POSE, "depth")


def test_an_agent_that_sees_more_than_colour_pictures_is_refused_in_a_line(live, world, camera):
    for agent, others in ((shortest_paths(world), "pose"), (Poseless(), "depth, pose")):
        with pytest.raises(AgentError, match=f"^the agent sees {others}, and live walks take colour pictures. [^\n]*$"):
            walked(live, world, camera, agent)


def test_the_memory_of_an_episode_stays_its_own_when_others_end(live, world, camera):
    """Walked alone, with the others' targets gone, each episode is the same."""
    target = live.scene.name, world.scene_state(1)
    alone = make_world([live.scene], {target[0]: (target[1],)})
    whole, part = (walked(live, one, camera, by_pictures(live, shortest_paths(one), one)) for one in (world, alone))
    assert len({len(walk) for walk in whole.walks}) > 2, "all end together: this shows nothing"
    for first, second in zip(whole.walks[4:], part.walks, strict=True):
        np.testing.assert_array_equal(first, second)
