import torch

from clearway.evaluation.policies import argmax, random_policy, shortest_path_policy
from clearway.world.tables import make_world
from helpers.made import corridor_scene, grid_scene


def test_the_shortest_path_policy_shares_ties():
    # Facing away from the target's heading: both turns are two turns away, so they share.
    world = make_world([corridor_scene(3)], {"corridor": [0]})
    probabilities = shortest_path_policy(world)(torch.tensor([[2] * 4, [4] * 4, [1] * 4]), torch.zeros(3).long())
    expected = torch.tensor([[0, 0.5, 0.5, 0], [0, 0, 0, 1], [0, 0, 1, 0]], dtype=torch.float64)
    assert torch.equal(probabilities, expected)


def test_every_optimal_action_is_one_step_nearer_and_no_other_is():
    scene = grid_scene(1)
    world = make_world([scene], {"grid": [5]})
    states = torch.arange(scene.state_count)
    probabilities = shortest_path_policy(world)(states[:, None].repeat(1, 4), torch.zeros_like(states))
    distance = torch.from_numpy(scene.distances[:, 5])
    nearer = distance[world.next_state] == distance[:, None] - 1
    assert torch.equal(probabilities > 0, nearer)
    assert torch.allclose(probabilities.sum(1), (states != 5).double())


def test_argmax_takes_the_first_of_equals():
    history, target = torch.zeros(2, 4).long(), torch.zeros(2).long()
    weights = torch.tensor([[0.1, 0.4, 0.1, 0.4], [0.0, 0.1, 0.9, 0.0]])
    taken = argmax(lambda h, t: weights)(history, target)
    assert taken.tolist() == [[0, 1, 0, 0], [0, 0, 1, 0]]
    assert random_policy()(history, target).tolist() == [[0.25] * 4] * 2
