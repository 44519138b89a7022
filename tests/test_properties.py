"""Random graphs: zones, distances, transitions and the oracle agree with references that follow the definitions."""

from collections import deque

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from clearway.evaluation.oracle import action_values, expected, make_task, optimal_policy, soft_policy
from clearway.reward import BUMP, COLLISION_AWARE, SHORTEST, Reward
from clearway.scenes import graph as graphs
from clearway.scenes.actions import Action
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.validate import check_scene
from clearway.world.navigation import Navigation
from clearway.world.world import make_world
from clearway.zones import Zone, cell_zones, pose_zones

MOVES = (Action.MOVE_FORWARD, Action.MOVE_BACKWARD)
DISCOUNT, ENTROPY = 0.9, 0.1
EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Some places with some headings; moves lead anywhere or nowhere, one way or both."""
    places, headings = draw(st.integers(1, 5)), draw(st.integers(3, 5))
    count = places * headings
    ends = st.lists(st.integers(-1, count - 1), min_size=count, max_size=count)
    state = np.arange(count)
    place, heading = state // headings, state % headings
    graph = np.empty((count, 4), np.int32)
    graph[:, Action.TURN_RIGHT] = place * headings + (heading + 1) % headings
    graph[:, Action.TURN_LEFT] = place * headings + (heading - 1) % headings
    for action in MOVES:
        graph[:, action] = draw(ends)
        graph[graph[:, action] == state, action] = -1
    assume((graph[:, MOVES] >= 0).any())
    scene = Scene(
        name="random",
        observations=None,
        features=None,
        locations_m=np.stack([0.5 * place, 0.0 * place], axis=1),
        headings_deg=np.round(heading * 360 / headings).astype(np.int64),
        graph=graph,
        made_by=Provenance("test"),
    )
    check_scene(scene)
    return scene


def steps_between(graph: np.ndarray, start: int) -> list[int]:
    """Breadth-first search, written plainly; -1 where there is no way."""
    steps = [-1] * len(graph)
    steps[start] = 0
    queue = deque([start])
    while queue:
        here = queue.popleft()
        for end in graph[here].tolist():
            if end >= 0 and steps[end] < 0:
                steps[end] = steps[here] + 1
                queue.append(end)
    return steps


def zone_of(graph: np.ndarray, state: int) -> Zone:
    """By the definition, pose by pose."""

    def stuck(pose: int) -> bool:
        return any(graph[pose, move] < 0 for move in MOVES)

    if stuck(state):
        return Zone.COLLISION
    return Zone.PRECOLLISION if any(stuck(graph[state, move]) for move in MOVES) else Zone.FREE


def reachable_target(scene: Scene) -> int:
    """A state that others lead to: where most of the graph can go."""
    return int((graphs.distances(scene.graph) >= 0).sum(0).argmax())


@EXAMPLES
@given(scenes())
def test_distances_are_those_of_a_plain_search(scene: Scene) -> None:
    expected_steps = [steps_between(scene.graph, start) for start in range(scene.state_count)]
    np.testing.assert_array_equal(scene.distances, expected_steps)
    targets = np.arange(scene.state_count)
    np.testing.assert_array_equal(scene.distances_to(targets), np.transpose(expected_steps))


@EXAMPLES
@given(scenes())
def test_components_hold_states_that_reach_each_other(scene: Scene) -> None:
    there = scene.distances >= 0
    together = scene.components[:, None] == scene.components[None]
    np.testing.assert_array_equal(together, there & there.T)
    sizes = np.bincount(scene.components)
    assert (np.diff(sizes) <= 0).all()


@EXAMPLES
@given(scenes())
def test_zones_are_those_of_the_definition(scene: Scene) -> None:
    found = pose_zones(scene.graph)
    assert found.tolist() == [zone_of(scene.graph, state) for state in range(scene.state_count)]
    by_cell = cell_zones(scene.graph, scene.cells)
    for cell in range(scene.cell_count):
        own = np.flatnonzero(scene.cells == cell)
        assert len(set(by_cell[own].tolist())) == 1
        assert (by_cell[own[0]] == Zone.COLLISION) == (found[own] == Zone.COLLISION).any()


@EXAMPLES
@given(scenes(), st.sampled_from([SHORTEST, COLLISION_AWARE, BUMP]), st.integers(0, 2**31), st.integers(1, 12))
def test_environments_follow_the_graph_and_the_reward_s_rules(
    scene: Scene, reward: Reward, seed: int, limit: int
) -> None:
    target = reachable_target(scene)
    world = make_world([scene], {scene.name: (target,)})
    envs = Navigation(world, reward, torch.arange(3) + seed, step_limit=limit, reward_dtype=torch.float64)
    envs.reset()
    rng = np.random.default_rng(seed)
    for step in range(1, limit + 1):
        before, actions = envs.state.tolist(), rng.integers(4, size=3)
        found = envs.step(torch.from_numpy(actions))
        for env, (here, action) in enumerate(zip(before, actions.tolist(), strict=True)):
            end = int(scene.graph[here, action])
            there = here if end < 0 else end
            assert int(found.state[env]) == there
            assert bool(found.blocked[env]) == (end < 0)
            assert bool(found.reached[env]) == (there == target)
            assert bool(found.truncated[env]) == (step == limit and there != target)
            assert float(found.reward[env]) == earned(reward, scene, there, target, end < 0)


def earned(reward: Reward, scene: Scene, there: int, target: int, blocked: bool) -> float:
    if there == target:
        return reward.parameters["terminal"]
    if blocked and "blocked" in reward.parameters:
        return reward.parameters["blocked"]
    name = {Zone.FREE: "alpha", Zone.PRECOLLISION: "gamma", Zone.COLLISION: "beta"}[zone_of(scene.graph, there)]
    return reward.parameters.get(name, reward.parameters["alpha"])


@pytest.mark.slow
@EXAMPLES
@given(scenes(), st.sampled_from([SHORTEST, COLLISION_AWARE, BUMP]))
def test_the_optimal_policy_has_the_values_of_value_iteration(scene: Scene, reward: Reward) -> None:
    task = make_task(scene.graph, pose_zones(scene.graph), reachable_target(scene), reward)
    value = np.zeros(scene.state_count)
    for _ in range(400):  # 0.9 ** 400 is nothing
        value = action_values(task, value, DISCOUNT).max(1)
    policy = optimal_policy(task, DISCOUNT)
    values = action_values(task, value, DISCOUNT)
    np.testing.assert_allclose((policy * values).sum(1), value, atol=1e-7)
    best = values >= value[:, None] - 1e-8
    np.testing.assert_array_equal(policy > 0, best)
    if reward is SHORTEST:
        np.testing.assert_allclose(expected(task, policy).steps, task.steps_to_go[task.starts].mean())


@pytest.mark.slow
@EXAMPLES
@given(scenes(), st.sampled_from([SHORTEST, COLLISION_AWARE, BUMP]))
def test_the_soft_policy_is_the_softmax_of_its_own_values(scene: Scene, reward: Reward) -> None:
    task = make_task(scene.graph, pose_zones(scene.graph), reachable_target(scene), reward)
    policy = soft_policy(task, DISCOUNT, ENTROPY)
    value = np.zeros(scene.state_count)
    for _ in range(400):
        value = (policy * action_values(task, value, DISCOUNT)).sum(1)
    scores = action_values(task, value, DISCOUNT) / ENTROPY
    wanted = np.exp(scores - scores.max(1, keepdims=True))
    np.testing.assert_allclose(policy, wanted / wanted.sum(1, keepdims=True), atol=1e-6)


@EXAMPLES
@given(scenes(), st.integers(0, 100))
def test_expected_figures_are_those_of_walking_all_ways(scene: Scene, seed: int) -> None:
    """Probability mass is carried along the graph step by step, instead of one linear solve."""
    task = make_task(scene.graph, pose_zones(scene.graph), reachable_target(scene), SHORTEST)
    policy = np.random.default_rng(seed).dirichlet(np.ones(4), scene.state_count)
    found = expected(task, policy)
    if not np.isfinite(found.steps):
        return
    mass = np.zeros(scene.state_count)
    mass[task.starts] = 1 / len(task.starts)
    steps = collisions = visits = 0.0
    moved = np.zeros((scene.state_count, scene.state_count))
    np.add.at(moved, (np.arange(scene.state_count)[:, None], task.next_state), policy)
    moved[:, task.target] = 0
    bumps = (policy * task.blocked).sum(1)
    for _ in range(200_000):
        if mass.sum() < 1e-12:
            break
        steps += mass.sum()
        collisions += mass @ bumps
        after = mass @ moved
        visits += after[task.zone == Zone.COLLISION].sum()
        mass = after
    np.testing.assert_allclose(
        [found.steps, found.collisions, found.collision_visits], [steps, collisions, visits], rtol=1e-6
    )
