"""Ways of choosing actions: a policy that walks in circles under argmax gets out of them by its untried actions."""

import numpy as np
import pytest
import torch
from torch import Tensor

from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.policies import argmax, random_policy, shortest_path_policy
from clearway.evaluation.protocol import evaluate_agents
from clearway.evaluation.selection import UntriedActions
from clearway.model.policy import Policy
from clearway.scenes.actions import Action
from clearway.world.tables import make_world
from helpers.made import corridor_scene, grid_scene

FORWARD, RIGHT, LEFT, BACKWARD = Action


def turning_in_place() -> Policy:
    """Right above all, then forward, left, backward: argmax turns on the spot for ever."""
    chances = torch.tensor([0.3, 0.4, 0.2, 0.1])

    def policy(history: Tensor, target: Tensor) -> Tensor:
        return chances.expand(len(target), 4)

    return policy


def by_history(seed: int) -> Policy:
    """Nearly certain of actions that depend on the whole history in no sensible way."""
    weights = torch.randn(5, 4, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)

    def policy(history: Tensor, target: Tensor) -> Tensor:
        return (9 * torch.sin(torch.cat([history, target[:, None]], 1).double() @ weights)).softmax(1)

    return policy


def test_the_most_probable_untried_action_is_chosen_and_all_tried_begin_anew():
    untried = UntriedActions(2, 3, torch.device("cpu"))
    chances = torch.tensor([[0.3, 0.4, 0.2, 0.1]])
    here = torch.tensor([1]), torch.tensor([2])
    taken = [int(untried.choose(*here, chances)) for _ in range(6)]
    assert taken == [RIGHT, FORWARD, LEFT, BACKWARD, RIGHT, FORWARD]
    assert int(untried.choose(torch.tensor([1]), torch.tensor([1]), chances)) == RIGHT  # another pose
    assert int(untried.choose(torch.tensor([0]), torch.tensor([2]), chances)) == RIGHT  # another episode
    other = torch.tensor([[0.0, 0.0, 0.1, 0.9]])
    assert int(untried.choose(*here, other)) == BACKWARD  # what is left is ordered by the chances of now


def test_several_episodes_remember_for_themselves():
    untried = UntriedActions(3, 5, torch.device("cpu"))
    chances = torch.tensor([[0.3, 0.4, 0.2, 0.1], [0.7, 0.1, 0.1, 0.1]])
    episodes, states = torch.tensor([2, 0]), torch.tensor([4, 4])
    assert untried.choose(episodes, states, chances).tolist() == [RIGHT, FORWARD]
    assert untried.choose(episodes, states, chances).tolist() == [FORWARD, RIGHT]


def test_a_walk_typed_in():
    # Two cells; from cell 0 looking along the corridor (state 0) to the same heading in cell 1 (state 4). Turning right
    # leads through 1, 2, 3 back to 0; there forward is next. Start and target are fixed by leaving nothing else.
    world = make_world([corridor_scene(2)], {"corridor": [4]})
    table = run_episodes(
        world, turning_in_place(), selection="argmax-untried", episodes_per_target=60, record=True, step_cap=100
    )
    assert table.reached.all()
    walk = next(walk for walk in table.trajectories if walk.states[0] == 0)
    assert walk.states.tolist() == [0, 1, 2, 3, 0, 4]
    assert walk.actions.tolist() == [RIGHT, RIGHT, RIGHT, RIGHT, FORWARD]


@pytest.fixture(scope="module")
def world():
    return make_world([grid_scene(3), corridor_scene(5, feature_count=32)], {"grid": [0, 13, 31], "corridor": [19, 2]})


@pytest.mark.parametrize("policy", [turning_in_place(), *(by_history(seed) for seed in range(4))])
def test_what_loops_under_argmax_arrives_by_untried_actions(world, policy):
    looping = run_episodes(world, policy, selection="argmax", episodes_per_target=30)
    assert looping.looped.mean() > 0.2
    arriving = run_episodes(world, policy, selection="argmax-untried", episodes_per_target=30)
    assert arriving.reached.all() and not arriving.looped.any()
    assert np.array_equal(looping.reached, ~looping.looped)


def test_it_is_argmax_as_long_as_no_pose_comes_back(world):
    ideal = shortest_path_policy(world)
    greedy = run_episodes(world, ideal, selection="argmax", episodes_per_target=30)
    untried = run_episodes(world, ideal, selection="argmax-untried", episodes_per_target=30)
    for name in ("start", "steps", "collisions", "zone_steps", "reached"):
        assert np.array_equal(getattr(greedy, name), getattr(untried, name))


def test_it_is_deterministic_and_the_same_whatever_runs_beside_it(world):
    policy, settings = by_history(0), {"selection": "argmax-untried", "episodes_per_target": 20}
    whole = run_episodes(world, policy, **settings)
    parts = run_episodes(world, policy, **settings, episodes_at_once=7)
    recorded = run_episodes(world, policy, **settings, record=True)
    for other in (parts, recorded):
        assert np.array_equal(whole.steps, other.steps) and np.array_equal(whole.collisions, other.collisions)
    start_and_target = whole.target * 10_000 + whole.start  # equal starts, equal walks: nothing is drawn
    _, first, place = np.unique(start_and_target, return_index=True, return_inverse=True)
    assert len(first) < len(whole)
    assert np.array_equal(whole.steps, whole.steps[first][place])


def test_argmax_as_a_selection_is_the_argmax_policy(world):
    policy = by_history(1)
    selected = run_episodes(world, policy, selection="argmax", episodes_per_target=20)
    made = run_episodes(world, argmax(policy), episodes_per_target=20)
    assert np.array_equal(selected.steps, made.steps) and np.array_equal(selected.looped, made.looped)


def test_sampling_never_counts_as_a_loop_and_a_failure_need_not_be_one(world):
    table = run_episodes(world, random_policy(), episodes_per_target=30, step_cap=20)
    assert not table.reached.all() and not table.looped.any()


def test_evaluations_report_the_share_that_loops(world):
    found = evaluate_agents(world, {"agent": turning_in_place()}, encoder="made-up", episodes_per_target=30)
    looped = {(e.agent, e.protocol.action_selection): e.to_json()["average"]["looped"] for e in found}
    argmax_row = found[1].to_json()["average"]
    assert looped["agent", "argmax"] == pytest.approx(1 - argmax_row["success"]) and argmax_row["looped"] > 0.5
    assert [share for row, share in looped.items() if row != ("agent", "argmax")] == [0.0] * 4
