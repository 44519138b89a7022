"""Agents that know their pose: what they tell, held against numbers typed in and against the graph."""

import numpy as np
import pytest
import torch

from clearway.agents.agent import POSE
from clearway.agents.by_pose import PoseAgent, RandomWalk, by_policies, network_on_poses, shortest_paths
from clearway.errors import AgentError
from clearway.model.lookup import LookupNetwork
from clearway.world.world import make_world
from helpers.agents import after_poses, told_after
from helpers.made import corridor_scene, grid_scene
from helpers.small_runs import small_network, small_world


def test_the_shortest_paths_share_ties():
    # Facing away from the target's heading: both turns are two turns away, so they share.
    world = make_world([corridor_scene(3)], {"corridor": [0]})
    found = told_after(shortest_paths(world), world, torch.tensor([[2] * 4, [4] * 4, [1] * 4]), torch.zeros(3).long())
    expected = torch.tensor([[0, 0.5, 0.5, 0], [0, 0, 0, 1], [0, 0, 1, 0]], dtype=torch.float64)
    assert torch.equal(found, expected)


def test_every_optimal_action_is_one_step_nearer_and_no_other_is():
    scene = grid_scene(1)
    world = make_world([scene], {"grid": [5]})
    states = torch.arange(scene.state_count)
    found = told_after(shortest_paths(world), world, states[:, None].repeat(1, 4), torch.zeros_like(states))
    distance = torch.from_numpy(scene.distances[:, 5])
    nearer = distance[world.next_state] == distance[:, None] - 1
    assert torch.equal(found > 0, nearer)
    assert torch.allclose(found.sum(1), (states != 5).double())


def test_the_random_walk_takes_all_actions_alike_and_tells_so():
    agent, memory = RandomWalk(), RandomWalk().reset({}, np.arange(2000))
    taken = []
    for _ in range(4):
        decisions, memory = agent.act({}, memory)
        assert (decisions.probabilities == 0.25).all() and not decisions.certain.any() and decisions.value is None
        taken.append(decisions.action)
    share = np.bincount(np.concatenate(taken), minlength=4) / 8000
    np.testing.assert_allclose(share, 0.25, atol=4 * 0.5 / np.sqrt(8000))


def test_a_rule_is_asked_with_the_last_poses_and_the_target_of_the_world():
    world, asked = make_world([corridor_scene(5)], {"corridor": [8, 16]}), []

    def rule(history, target):
        asked.append((history.tolist(), target.tolist()))
        return torch.full((len(target), 4), 0.25), 10.0 * target

    agent = PoseAgent(world, rule, 3)
    memory = agent.reset({POSE: np.array([16, 8])}, np.array([1, 2]))
    for poses in ([4, 0], [5, 1], [6, 2], [7, 3]):
        decisions, memory = agent.act({POSE: np.array(poses)}, memory)
        assert decisions.value.tolist() == [10.0, 0.0]
    assert [history[0] for history, _ in asked] == [[4, 4, 4], [4, 4, 5], [4, 5, 6], [5, 6, 7]]
    assert [history[1] for history, _ in asked] == [[0, 0, 0], [0, 0, 1], [0, 1, 2], [1, 2, 3]]
    assert {tuple(target) for _, target in asked} == {(1, 0)}


def test_a_target_that_the_world_does_not_have_is_no_target():
    agent = shortest_paths(make_world([corridor_scene(5)], {"corridor": [8]}))
    with pytest.raises(AgentError, match="made for a world without target"):
        agent.reset({POSE: np.array([8, 4])}, np.array([1, 2]))


def test_a_policy_is_read_at_the_newest_pose_for_the_own_target_in_its_scene():
    world = make_world([corridor_scene(2, feature_count=32), grid_scene(1)], {"corridor": [0, 4], "grid": [5, 7]})
    states = world.scene_offset.diff().tolist()
    rng = np.random.default_rng(0)
    policies = [rng.random((states[scene], 4), dtype=np.float32) for scene in (0, 0, 1, 1)]
    history = torch.tensor([[1, 2, 7], [7, 2, 3], [8, 8, 8], [9, 9, states[0] + states[1] - 1]])
    found = told_after(by_policies(world, policies), world, history, torch.tensor([1, 0, 2, 3]))
    assert found.tolist() == [policies[target][pose].tolist() for target, pose in ((1, 7), (0, 3), (2, 0), (3, -1))]
    elsewhere = torch.tensor([[8, 8, 8], [8, 8, 7]])  # the grid's first pose, the corridor's last
    assert told_after(by_policies(world, policies), world, elsewhere, torch.tensor([0, 2])).tolist() == [[0.0] * 4] * 2
    with pytest.raises(AssertionError):
        by_policies(world, policies[::-1])


@pytest.mark.parametrize("scale", [1.0, 8.0])
def test_a_network_tells_its_own_probabilities_and_values_in_units_of_the_reward(scale):
    world = small_world()
    network = small_network(world)
    agent = network_on_poses(LookupNetwork(network, world.features, world.target_state), world, scale)
    target = torch.tensor([4, 0, 3, 1])  # scenes in any order
    first = world.scene_offset[world.target_scene[target]]
    history = first[:, None] + torch.randint(20, (4, 4), generator=torch.Generator().manual_seed(0))
    found = after_poses(agent, world, history, target)
    seen, wanted = world.features[history], world.features[world.target_state][target]
    with torch.no_grad():
        scores, value = network(seen, wanted, world.target_scene[target])
    np.testing.assert_allclose(found.probabilities, torch.softmax(scores, 1).numpy(), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(found.value * scale, value.numpy(), rtol=1e-4, atol=1e-6)
