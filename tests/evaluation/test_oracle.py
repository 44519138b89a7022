"""The oracle against typed-in numbers, brute force and walked episodes."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.agents.agent import Agent
from clearway.agents.by_pose import by_policies
from clearway.errors import SceneError
from clearway.evaluation import oracle
from clearway.evaluation.episodes import episode_starts, run_episodes
from clearway.evaluation.optimum import TargetYardstick, world_yardsticks
from clearway.evaluation.oracle import action_values, make_task, optimal_policy, soft_policy, yardstick
from clearway.evaluation.runs import _optima
from clearway.reward import COLLISION_AWARE, SHORTEST, Reward
from clearway.world.world import World, make_world
from clearway.zones import Zone, pose_zones
from helpers.agents import told_after
from helpers.made import corridor_scene, grid_scene

ONE_CELL = np.array([[-1, 1, 3, -1], [-1, 2, 0, -1], [-1, 3, 1, -1], [-1, 0, 2, -1]], np.int32)


def one_cell(reward: Reward = SHORTEST):
    return make_task(ONE_CELL, pose_zones(ONE_CELL), 0, reward)


def test_one_cell_optimum_is_the_shortest_path_with_ties_averaged():
    found = yardstick(one_cell(), entropy_weight=0.01)
    assert found.shortest_path_steps == pytest.approx(4 / 3)
    assert found.optimal.steps == pytest.approx(4 / 3)
    assert found.optimal.collisions == 0
    assert found.optimal.collision_visits == pytest.approx(1 / 3)  # from heading 180 over 90 or 270
    assert found.optimal.precollision_visits == 0
    assert found.optimal_policy[2].tolist() == [0, 0.5, 0.5, 0]


def test_one_cell_soft_policy_of_endless_entropy_is_the_random_walk():
    found = yardstick(one_cell(), entropy_weight=1e9)
    assert found.soft.steps == pytest.approx(20 / 3)  # h(90) = h(270) = 6, h(180) = 8
    assert found.soft.collisions == pytest.approx(10 / 3)  # half of all actions are moves
    assert found.soft.collision_visits == pytest.approx(17 / 3)  # all arrivals but the last


def test_two_cells_typed_in():
    # Cells 0 and 1 along z; heading 0 looks from 0 to 1. Target: cell 1, heading 0 (state 4).
    graph = np.full((8, 4), -1, np.int32)
    for cell in range(2):
        for heading in range(4):
            graph[4 * cell + heading, 1:3] = 4 * cell + (heading + 1) % 4, 4 * cell + (heading - 1) % 4
    graph[0, 0], graph[2, 3], graph[4, 3], graph[6, 0] = 4, 6, 0, 2
    found = yardstick(make_task(graph, pose_zones(graph), 4, SHORTEST))
    # from cell 0: headings 0, 90, 180, 270 need 1, 2, 3, 2 steps; from cell 1: 90, 180, 270 need 1, 2, 1
    assert found.shortest_path_steps == pytest.approx((1 + 2 + 3 + 2 + 1 + 2 + 1) / 7)
    assert found.optimal.steps == pytest.approx(12 / 7)


@pytest.mark.parametrize("alpha", [0.5, 0.05])
def test_where_walking_on_earns_more_than_arriving_no_episode_ends(alpha: float) -> None:
    """A step in the open that earns something for ever is worth more than a target that ends it."""
    scene = grid_scene(1, width=5, depth=5)
    world = make_world([scene], {scene.name: [0]})
    reward = COLLISION_AWARE.with_changes(alpha=alpha, clip=True)
    (found,) = world_yardsticks(world, reward)
    assert found.yardstick.optimal.steps == found.yardstick.soft.steps == np.inf
    assert found.to_json()["optimal"] == {"steps": None, "collision_visits": None, "precollision_visits": None}
    best = acting(world, [found], "optimal")
    walked = run_episodes(world, best, episodes_per_target=20, step_limit=300, seed=0)
    assert not walked.reached.all()


def test_no_state_leads_to_the_target():
    lonely = np.array([[-1, 1, 1, -1], [-1, 1, 1, -1]], np.int32)
    with pytest.raises(SceneError, match="no state leads to target 0"):
        make_task(lonely, pose_zones(lonely), 0, SHORTEST)


def test_a_policy_that_can_step_into_a_trap_never_surely_arrives():
    # 0 is the target, 1 leads to it or into the trap 2.
    graph = np.array([[0, 0, 0, 0], [0, 2, 0, 0], [2, 2, 2, 2]], np.int32)
    found = yardstick(make_task(graph, np.zeros(3, int), 0, SHORTEST), entropy_weight=0.1)
    assert found.optimal.steps == 1
    assert found.soft.steps == np.inf


@pytest.mark.parametrize("reward", [SHORTEST, COLLISION_AWARE, COLLISION_AWARE.with_changes(beta=-0.5, clip=True)])
def test_policies_agree_with_brute_force(reward):
    scene = grid_scene(3)
    task = make_task(scene.graph, pose_zones(scene.graph), int(np.flatnonzero(scene.components == 0)[5]), reward)

    best = np.zeros(scene.state_count)
    soft = np.zeros(scene.state_count)
    for _ in range(5000):
        best = action_values(task, best, 0.99).max(1)
        values = action_values(task, soft, 0.99)
        weights = np.exp((values - values.max(1, keepdims=True)) / 0.05)
        soft = (weights * values).sum(1) / weights.sum(1)
    values = action_values(task, best, 0.99)
    ties = values >= values.max(1, keepdims=True) - 1e-8
    np.testing.assert_allclose(optimal_policy(task)[task.starts], (ties / ties.sum(1, keepdims=True))[task.starts])
    values = action_values(task, soft, 0.99)
    weights = np.exp((values - values.max(1, keepdims=True)) / 0.05)
    policy = weights / weights.sum(1, keepdims=True)
    np.testing.assert_allclose(soft_policy(task, 0.99, 0.05), policy, atol=1e-7)


@pytest.mark.parametrize("reward", [replace(SHORTEST, clip=True), COLLISION_AWARE])
@pytest.mark.parametrize("entropy_weight", [0.001, 0.01, 0.1])
def test_no_other_soft_policy_is_found_from_other_values(reward: Reward, entropy_weight: float) -> None:
    scene, rng = grid_scene(3), np.random.default_rng(0)
    task = make_task(scene.graph, pose_zones(scene.graph), int(np.flatnonzero(scene.components == 0)[5]), reward)
    own = soft_policy(task, 0.99, entropy_weight)
    for scale in (0.01, 1.0, 100.0):
        for drawn in (rng.normal(0, scale, len(own)), np.full(len(own), scale), np.full(len(own), -scale)):
            found = soft_policy(task, 0.99, entropy_weight, drawn)
            np.testing.assert_allclose(found[task.starts], own[task.starts], atol=1e-7)


def test_a_dear_collision_zone_lengthens_the_way():
    scene = grid_scene(3)
    target = int(np.flatnonzero(scene.components == 0)[5])
    zones = pose_zones(scene.graph)
    cheap = yardstick(make_task(scene.graph, zones, target, COLLISION_AWARE)).optimal
    dear = yardstick(make_task(scene.graph, zones, target, COLLISION_AWARE.with_changes(beta=-2.0))).optimal
    assert dear.steps > cheap.steps
    assert dear.collision_visits < cheap.collision_visits


def test_figures_from_given_starts_are_means_over_those() -> None:
    scene = grid_scene(3)
    target = int(np.flatnonzero(scene.components == 0)[5])
    task = make_task(scene.graph, pose_zones(scene.graph), target, COLLISION_AWARE)
    alone = [yardstick(task, starts=np.array([start])) for start in task.starts[[3, 8, 8]]]
    found = yardstick(task, starts=task.starts[[3, 8, 8]])
    assert found.shortest_path_steps == np.mean([each.shortest_path_steps for each in alone])
    for kind in ("optimal", "soft"):
        for name in ("steps", "collisions", "collision_visits", "precollision_visits"):
            mean = np.mean([getattr(getattr(each, kind), name) for each in alone])
            assert getattr(getattr(found, kind), name) == pytest.approx(mean)
    every, given = yardstick(task), yardstick(task, starts=task.starts)
    assert given.shortest_path_steps == every.shortest_path_steps
    assert vars(given.soft) == pytest.approx(vars(every.soft))


def acting(world: World, found: list[TargetYardstick], kind: str) -> Agent:
    """By the optimal or the soft policies of a world's yardsticks."""
    return by_policies(world, [getattr(each.yardstick, f"{kind}_policy") for each in found])


def test_the_world_s_starts_are_those_of_the_episodes() -> None:
    scenes = [grid_scene(1, name="one"), corridor_scene(5, feature_count=32)]
    world = make_world(scenes, {scene.name: (2, 9) for scene in scenes})
    starts = episode_starts(world, 7, seed=5)
    agent = acting(world, world_yardsticks(world, COLLISION_AWARE), "soft")
    table = run_episodes(world, agent, episodes_per_target=7, seed=5)
    assert starts.reshape(-1).tolist() == table.start.tolist()
    found = world_yardsticks(world, COLLISION_AWARE, starts=starts)
    walked = [table.shortest_path_steps[table.target == target].mean() for target in range(4)]
    assert [each.yardstick.shortest_path_steps for each in found] == pytest.approx(walked)


def test_expected_figures_agree_with_walked_episodes():
    scenes = [grid_scene(1, name="one"), corridor_scene(5, feature_count=32)]
    world = make_world(scenes, {scene.name: (2, 9) for scene in scenes})
    found = world_yardsticks(world, COLLISION_AWARE.with_changes(clip=True), entropy_weight=0.02)
    episodes = 4000
    for kind in ("optimal", "soft"):
        table = run_episodes(world, acting(world, found, kind), episodes_per_target=episodes, seed=1)
        for index, one in enumerate(found):
            exact, rows = getattr(one.yardstick, kind), table.target == index
            figures = {
                "steps": table.steps[rows],
                "collisions": table.collisions[rows],
                "collision_visits": table.zone_steps[rows, Zone.COLLISION],
                "precollision_visits": table.zone_steps[rows, Zone.PRECOLLISION],
            }
            for name, walked in figures.items():
                sigma = max(walked.std() / np.sqrt(episodes), 1e-9)
                assert abs(walked.mean() - getattr(exact, name)) < 4.5 * sigma, (kind, index, name)


def test_json_has_the_promised_keys():
    scene = corridor_scene(4)
    (found,) = world_yardsticks(make_world([scene], {scene.name: (3,)}), COLLISION_AWARE)
    content = json.loads(json.dumps(found.to_json()))
    assert set(content) == {"scene", "target", "shortest_path_steps", "optimal", "soft"}
    assert set(content["optimal"]) == {"steps", "collision_visits", "precollision_visits"}
    assert set(content["soft"]) == {"steps", "collisions", "collision_visits", "precollision_visits"}
    assert content["target"] == 3


def test_agents_by_policies_stand_on_the_worlds_numbering():
    scenes = [corridor_scene(3, feature_count=32), grid_scene(2, name="two")]
    world = make_world(scenes, {scene.name: (1,) for scene in scenes})
    best = acting(world, world_yardsticks(world, SHORTEST), "optimal")
    first = int(world.scene_offset[1])
    history = torch.full((1, 4), first + 2)
    np.testing.assert_allclose(told_after(best, world, history, torch.tensor([1])).sum(1), 1.0, atol=1e-6)
    assert float(told_after(best, world, history, torch.tensor([0])).sum()) == 0


def test_the_tables_soft_fixed_point_is_that_of_clipped_rewards() -> None:
    """Published rewards are clipped; a run's own reward need not be."""
    scene = grid_scene(2, width=4, depth=4)
    world = make_world([scene], {scene.name: [5]})
    agents = _optima(world, [COLLISION_AWARE])
    for name, clip, kind in (("optimum", False, "optimal"), ("soft fixed point", True, "soft")):
        expected, other = (
            acting(world, world_yardsticks(world, replace(COLLISION_AWARE, clip=own)), kind) for own in (clip, not clip)
        )
        history, target = torch.arange(scene.state_count)[:, None], torch.zeros(scene.state_count, dtype=torch.int64)
        agent = agents[f"{name} (collision-aware{'' if clip else ', unclipped'})"]
        own, wanted, else_told = (told_after(one, world, history, target) for one in (agent, expected, other))
        assert torch.equal(own, wanted)
        assert kind == "optimal" or not torch.allclose(own, else_told, atol=1e-3)


def test_where_the_soft_policy_does_not_settle_its_row_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a reward that pays for the collision zone, as one that has lost a minus sign does."""
    scene = grid_scene(1, width=5, depth=5)
    world = make_world([scene], {scene.name: [0]})
    monkeypatch.setattr(oracle, "MOST_ROUNDS", 100)  # it does not in 1,000 either
    strange = COLLISION_AWARE.with_changes(beta=0.02)
    with pytest.warns(UserWarning, match=r"no row 'soft fixed point \(.*\)': grid, target 0: the soft policy") as told:
        agents = _optima(world, [SHORTEST, strange, replace(strange, clip=True)])
    assert len(told) == 1 and len(agents) == 4 and sum(name.startswith("soft") for name in agents) == 1
