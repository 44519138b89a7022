"""What was blocked is not tried again where the very same is seen."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from clearway.agents.agent import FEATURES, LAST_ACTION
from clearway.agents.blocked import PICTURES, add_blocked, nothing_blocked, without_blocked
from clearway.agents.selection import Argmax
from clearway.scenes.actions import Action
from clearway.world.world import World
from helpers.small_eyes import recurrent
from helpers.small_runs import small_world

FORWARD, RIGHT, LEFT, BACKWARD = Action
WORLD = small_world()
EVEN = np.full((1, 4), 0.25)


def one(*numbers: int) -> np.ndarray:
    return np.array(numbers, np.int64)


def after(*bumps: tuple[int, int]) -> dict[str, np.ndarray]:
    """Of one episode, that saw marks again after actions."""
    state = nothing_blocked(1)
    for mark, action in bumps:
        state = add_blocked(state, one(mark), one(action), np.array([True]))
    return dict(state)


def test_a_blocked_move_is_not_tried_where_the_same_is_seen() -> None:
    state = after((7, FORWARD))
    assert without_blocked(state, one(7), EVEN).tolist() == [[0, 1 / 3, 1 / 3, 1 / 3]]
    assert without_blocked(state, one(8), EVEN).tolist() == EVEN.tolist()
    both = after((7, FORWARD), (9, BACKWARD), (7, BACKWARD))
    assert without_blocked(both, one(7), EVEN).tolist() == [[0, 0.5, 0.5, 0]]
    assert without_blocked(both, one(9), EVEN).tolist() == [[1 / 3, 1 / 3, 1 / 3, 0]]


def test_a_turn_is_never_blocked_nor_is_a_move_after_which_another_picture_came() -> None:
    assert without_blocked(after((7, RIGHT), (7, LEFT)), one(7), EVEN).tolist() == EVEN.tolist()
    state = add_blocked(nothing_blocked(1), one(7), one(FORWARD), np.array([False]))
    assert without_blocked(state, one(7), EVEN).tolist() == EVEN.tolist()


def test_who_gives_everything_to_what_is_blocked_keeps_it() -> None:
    certain = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert without_blocked(after((7, FORWARD)), one(7), certain).tolist() == certain.tolist()


def test_where_nothing_was_blocked_probabilities_stay_to_the_bit() -> None:
    made = np.random.default_rng(0).dirichlet(np.ones(4), size=200)
    state = nothing_blocked(200)
    assert np.array_equal(without_blocked(state, np.arange(200) % 3, made), made)


def test_the_oldest_picture_makes_room() -> None:
    state = after(*((mark, FORWARD) for mark in range(1, PICTURES + 2)))
    assert without_blocked(state, one(1), EVEN).tolist() == EVEN.tolist()
    for mark in (2, PICTURES + 1):
        assert without_blocked(state, one(mark), EVEN)[0, FORWARD] == 0


def test_nothing_given_is_changed() -> None:
    state = nothing_blocked(2)
    add_blocked(state, one(7, 7), one(FORWARD, FORWARD), np.array([True, True]))
    assert not any(values.any() for values in state.values())


def walked(world: World, steps: int, **kind: bool) -> list[tuple[int, int]]:
    """Blocked moves (pose, action) of an episode of a recurrent agent."""
    agent, pose, bumps = recurrent(world, **kind), 0, []
    features, graph = world.features, world.next_state
    assert features is not None
    state = agent.reset({FEATURES: features[4:5].numpy()}, np.array([3]))
    for _ in range(steps):
        decisions, state = agent.act({FEATURES: features[pose : pose + 1].numpy()}, state)
        action = int(decisions.action[0])
        if graph[pose, action] == pose:
            bumps.append((pose, action))
        else:
            pose = int(graph[pose, action])
    return bumps


def test_the_recurrent_agent_bumps_into_nothing_twice() -> None:
    bumps = walked(WORLD, 300)
    assert bumps and len(set(bumps)) == len(bumps)


@pytest.mark.parametrize("kind", [{"tries_again": True}, {"remembers": False}])
def test_one_that_may_try_again_or_forgets_does(kind: dict[str, bool]) -> None:
    bumps = walked(WORLD, 300, **kind)
    assert len(bumps) > len(set(bumps))


def test_argmax_tells_the_agent_what_it_took() -> None:
    features = WORLD.features
    assert isinstance(features, torch.Tensor)
    agent = recurrent(WORLD)
    state = Argmax(agent).reset({FEATURES: features[:2].numpy()}, np.arange(2))
    for _ in range(8):
        own, _ = agent.act({FEATURES: features[5:7].numpy()}, state)
        decisions, state = Argmax(agent).act({FEATURES: features[5:7].numpy()}, state)
        assert np.array_equal(state[LAST_ACTION], decisions.action)
        assert own.probabilities is not None and np.array_equal(decisions.action, own.probabilities.argmax(1))
