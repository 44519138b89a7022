"""Agents on a map of steps that were seen."""

import numpy as np
import pytest

from clearway.agents.agent import FEATURES, POSE
from clearway.agents.on_learnt_map import UNSEEN, WALKERS, MapPlanner, NearestPicture, nearest_pictures, seen_by_walkers
from clearway.evaluation.episodes import run_episodes
from clearway.scenes.actions import Action
from clearway.world.world import World, make_world
from helpers.made import grid_scene


@pytest.fixture(scope="module")
def world() -> World:
    scene = grid_scene(1, width=5, depth=5, obstacle_share=0.1, feature_count=8)
    return make_world([scene], {scene.name: [0, 13]})


def test_on_a_whole_map_it_takes_the_fewest_steps_without_a_collision(world: World) -> None:
    table = run_episodes(world, MapPlanner(world.next_state.numpy()), episodes_per_target=20)
    np.testing.assert_array_equal(table.steps, table.shortest_path_steps)
    assert table.reached.all() and not table.collisions.any()


def test_who_sees_pictures_of_a_whole_map_knows_its_pose_by_them(world: World) -> None:
    assert world.features is not None
    features = world.features.numpy()
    agent = NearestPicture(world.next_state.numpy(), features + np.float32(1e-3))
    table = run_episodes(world, agent, episodes_per_target=20)
    np.testing.assert_array_equal(table.steps, table.shortest_path_steps)
    taken_for = nearest_pictures(world.next_state.numpy(), features)
    np.testing.assert_array_equal(taken_for, np.arange(len(features)))


def test_it_goes_only_by_steps_that_were_seen() -> None:
    seen = np.full((4, 4), UNSEEN)
    seen[0, Action.TURN_LEFT], seen[1, Action.MOVE_FORWARD] = 1, 2
    planner = MapPlanner(seen)
    poses = np.array([0, 1, 2, 3])
    state = planner.reset({POSE: np.full(4, 2)}, np.arange(4))
    decisions, _ = planner.act({POSE: poses}, state)
    assert decisions.probabilities is not None
    assert decisions.action[:2].tolist() == [Action.TURN_LEFT, Action.MOVE_FORWARD]
    np.testing.assert_array_equal(decisions.probabilities[2:], 0.25)  # at the target, and where no way is known


def test_pictures_that_were_not_seen_are_not_known() -> None:
    seen = np.full((3, 4), UNSEEN)
    seen[0, Action.MOVE_FORWARD] = 1
    features = np.array([[0.0], [1.0], [5.0]], np.float32)
    assert nearest_pictures(seen, features).tolist() == [0, 1, 1]
    by_view, by_pose = NearestPicture(seen, features), MapPlanner(seen, nearest_pictures(seen, features))
    for agent, seen_at in ((by_view, {FEATURES: features}), (by_pose, {POSE: np.arange(3)})):
        assert agent.sees == tuple(seen_at)
        state = agent.reset({name: values[[1, 2]] for name, values in seen_at.items()}, np.zeros(2, np.int64))
        assert state["target"].tolist() == [1, 1]
        decisions, _ = agent.act({name: values[[0, 0]] for name, values in seen_at.items()}, state)
        assert decisions.action.tolist() == [Action.MOVE_FORWARD] * 2


def test_walkers_see_as_many_steps_as_there_are_frames_and_no_others(world: World) -> None:
    one, many = seen_by_walkers(world, 1, seed=3), seen_by_walkers(world, 40 * WALKERS, seed=3)
    assert (one != UNSEEN).sum() == 1
    known = many != UNSEEN
    np.testing.assert_array_equal(many[known], world.next_state.numpy()[known])
    assert known.sum() > (seen_by_walkers(world, 2 * WALKERS, seed=3) != UNSEEN).sum()
    np.testing.assert_array_equal(one[one != UNSEEN], many[one != UNSEEN])
