"""The episode that is shown: a real walk, the longest among those that most agents finish."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.showcase import EPISODES, STEP_LIMIT, showcases
from clearway.scenes.actions import Action
from clearway.scenes.graph import next_states
from clearway.world.world import make_world
from helpers.agents import by_rule, only
from helpers.made import corridor_scene, grid_scene

SCENES = [grid_scene(2), corridor_scene(5, feature_count=32)]
TARGETS = {"grid": [3, 17, 40], "corridor": [0, 16]}
WORLD = make_world(SCENES, TARGETS)


@pytest.fixture(scope="module")
def shown():
    agents = {"shortest path": shortest_paths(WORLD), "random": RandomWalk()}
    return showcases(WORLD, agents, seed=4)


def test_there_is_one_for_each_scene_in_the_world_s_order(shown):
    assert [show.scene for show in shown] == ["grid", "corridor"]
    for show in shown:
        assert show.target in TARGETS[show.scene]
        assert list(show.walks) == ["shortest path", "random"]


def test_walks_are_walks_through_their_own_scene(shown):
    for scene, show in zip(SCENES, shown, strict=True):
        following = next_states(scene.graph)
        for walk in show.walks.values():
            assert len(walk.states) == len(walk.actions) + 1
            assert np.array_equal(following[walk.states[:-1], walk.actions], walk.states[1:])
            assert show.target not in walk.states[:-1]


def test_all_agents_start_alike_and_the_best_takes_the_shortest_path(shown):
    for scene, show in zip(SCENES, shown, strict=True):
        start = {int(walk.states[0]) for walk in show.walks.values()}
        assert len(start) == 1
        assert show.shortest_path_steps == scene.distances[start.pop(), show.target]
        ideal = show.walks["shortest path"]
        assert len(ideal.actions) == show.shortest_path_steps
        assert ideal.states[-1] == show.target


def test_it_is_the_longest_of_the_episodes_that_every_agent_finishes():
    agent = shortest_paths(WORLD)
    table = run_episodes(WORLD, agent, episodes_per_target=EPISODES, step_limit=STEP_LIMIT, seed=1)
    scene_of_episode = WORLD.target_scene.numpy()[table.target]
    longest = [table.shortest_path_steps[scene_of_episode == scene].max() for scene in range(2)]
    found = showcases(WORLD, {"ideal": agent}, seed=1)
    assert [show.shortest_path_steps for show in found] == longest


def test_an_episode_that_more_agents_finish_comes_before_a_longer_one():
    agents = {"ideal": shortest_paths(WORLD), "straight on": by_rule(WORLD, only(Action.MOVE_FORWARD))}
    corridor = showcases(WORLD, agents, seed=1)[1]
    straight = corridor.walks["straight on"]
    assert (corridor.target, straight.states[-1]) == (16, 16)  # the far end, looking along the corridor
    assert set(straight.actions.tolist()) == {Action.MOVE_FORWARD}
    assert corridor.shortest_path_steps == len(straight.actions) <= 4


def test_a_walk_that_does_not_arrive_ends_at_the_cap():
    world = make_world(SCENES[:1], {"grid": [3]})
    (show,) = showcases(world, {"stuck": by_rule(world, only(Action.TURN_RIGHT))})
    assert len(show.walks["stuck"].actions) == STEP_LIMIT
    assert set(show.walks["stuck"].actions.tolist()) == {Action.TURN_RIGHT}


@pytest.mark.slow
def test_a_seed_repeats_and_another_one_differs():
    def starts(seed: int) -> list[tuple[int, int]]:
        found = showcases(WORLD, {"random": RandomWalk()}, seed=seed)
        return [(show.target, *show.walks["random"].states.tolist()) for show in found]

    assert starts(0) == starts(0)
    assert starts(0) != starts(1)
