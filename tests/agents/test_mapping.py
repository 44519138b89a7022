from __future__ import annotations

import numpy as np
import pytest

from clearway.agents.agent import FEATURES
from clearway.agents.exploring import Explorer, map_of
from clearway.agents.mapping import MappingAgent
from clearway.evaluation import metrics
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.tours import Touring, walk_tour
from clearway.mapping.eyes_sight import EyesSight
from clearway.mapping.settings import MappingSettings
from clearway.perception.whereabouts import ELSEWHERE
from clearway.world.world import make_world
from helpers.agents import check_agent
from helpers.made import grid_scene
from helpers.perfect_sight import PerfectSight, seen_perfectly
from helpers.small_eyes import seen_by_eyes, small_eyes

SETTINGS = MappingSettings(side_m=15.0)


@pytest.fixture(scope="module")
def scene():
    return seen_perfectly(grid_scene(1, width=8, depth=7, obstacle_share=0.25))


@pytest.fixture(scope="module")
def world(scene):
    targets = np.random.default_rng(0).choice(np.flatnonzero(scene.components == 0), 12, replace=False)
    return make_world([scene], {scene.name: sorted(targets.tolist())})


def walked(world, agent):
    return run_episodes(world, agent, episodes_per_target=4, step_limit=300)


def test_with_good_eyes_it_finds_every_target_with_hardly_a_collision(scene, world):
    table = walked(world, MappingAgent(PerfectSight(scene), settings=SETTINGS))
    assert metrics.success(table).mean() == 1
    assert metrics.spl(table).mean() > 0.55 and table.collisions.mean() < 0.5
    assert table.false_arrivals is not None and (table.false_arrivals > 0).mean() < 0.1


def test_who_holds_itself_for_shut_in_forgets_that_and_finds_its_target(scene, world):
    agent = MappingAgent(PerfectSight(scene), settings=SETTINGS)
    target = int(world.target_state[0])
    here = int(np.flatnonzero((scene.components == 0) & (np.arange(scene.state_count) != target))[-1])
    state = agent.reset({FEATURES: scene.features[[target]]}, np.zeros(1, np.uint64))
    for step in range(200):
        decisions, state = agent.act({FEATURES: scene.features[[here]]}, state)
        if step == 0:
            state["shut"][:] = True
        following = scene.graph[here, decisions.action[0]]
        here = here if following < 0 else int(following)
        if here == target:
            break
    assert here == target


def test_who_sees_no_obstacles_bumps_into_them(scene, world):
    blind = PerfectSight(scene)
    blind.stands = lambda features: np.zeros((len(features), 63), np.float32)
    bumps, clears = (
        walked(world, MappingAgent(sight, settings=SETTINGS)).collisions.mean()
        for sight in (blind, PerfectSight(scene))
    )
    assert bumps > 1 > clears


def toured(scene, world, sight, steps=400):
    touring = Touring(
        lambda steps: Explorer(sight, steps, settings=SETTINGS),
        lambda state: MappingAgent(sight, known=map_of(state), settings=SETTINGS),
        steps,
    )
    return touring, walk_tour(world, touring, scene, seed=0)


def test_a_tour_comes_near_every_pose_before_it_comes_to_all():
    hall = seen_perfectly(grid_scene(1, width=14, depth=14, obstacle_share=0.25))
    targets = make_world([hall], {hall.name: [5, 9]})
    taken = [map_of(toured(hall, targets, PerfectSight(hall), steps)[1].state).taken for steps in (120, 1000)]
    apart = np.abs(taken[1][:, None] - taken[0]).astype(float)
    apart[..., 0][apart[..., 0] > 0] = np.inf  # another heading shows something else
    assert len(taken[0]) < 120 and len(taken[1]) > 500
    assert (apart.max(axis=2).min(axis=1) > 2).mean() < 0.15  # cells


def test_a_target_whose_very_picture_a_tour_has_taken_needs_no_eyes(scene, world):
    _, tour = toured(scene, world, PerfectSight(scene))
    blind = PerfectSight(scene)
    blind.whereabouts = lambda first, second: np.zeros((len(first), ELSEWHERE), np.float32)
    table = walked(world, MappingAgent(blind, known=map_of(tour.state), settings=SETTINGS))
    assert metrics.success(table).mean() == 1 and metrics.spl(table).mean() > 0.9


def test_after_a_tour_it_walks_almost_the_shortest_paths(scene, world):
    touring, tour = toured(scene, world, PerfectSight(scene))
    assert tour.poses == 1
    table = walked(world, touring.after(tour.state))
    assert metrics.success(table).mean() == 1 and metrics.spl(table).mean() > 0.9
    assert table.collisions.mean() <= 0.05
    assert table.told_arrival is not None and table.told_arrival.mean() > 0.9


def test_a_tour_follows_from_its_seed(scene, world):
    sight = PerfectSight(scene)
    touring = Touring(lambda steps: Explorer(sight, steps, settings=SETTINGS), lambda state: None, 30)
    one, again, other = (walk_tour(world, touring, scene, seed) for seed in (0, 0, 1))
    known = [map_of(tour.state) for tour in (one, again, other)]
    assert np.array_equal(known[0].features, known[1].features) and np.array_equal(known[0].room, known[1].room)
    assert known[0].taken.shape != known[2].taken.shape or not np.array_equal(known[0].features, known[2].features)


@pytest.mark.parametrize("kind", ["plain", "toured", "explorer"])
def test_it_keeps_the_protocol(tmp_path, kind):
    seen = seen_by_eyes(tmp_path / "eyes", grid_scene(2))[0]
    features = seen.features.astype(np.float32)
    sight = EyesSight(small_eyes().eval())
    settings = MappingSettings(side_m=7.0)
    explorer = Explorer(sight, 4, settings=settings)
    agent = {"explorer": explorer, "plain": MappingAgent(sight, settings=settings)}.get(kind)
    if agent is None:
        state = explorer.reset({}, np.arange(1))
        for row in range(4):
            _, state = explorer.act({FEATURES: features[row : row + 1]}, state)
        agent = MappingAgent(sight, known=map_of(state), settings=settings)
    rng = np.random.default_rng(0)
    observations = [{FEATURES: features[rng.integers(len(features), size=3)]} for _ in range(4)]
    assert check_agent(agent, observations, {FEATURES: features[:3]}, draws=False).shape == (4, 3)
