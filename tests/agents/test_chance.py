"""What agents draw follows from the episode's seed alone."""

import numpy as np
import torch

from clearway.agents.chance import ACTION_STREAM, chance_of, drawn
from clearway.model.policy import sampled
from clearway.world.streams import Streams

SEEDS = np.array([0, 1, 2**62, -5, 12345])


def test_an_agent_draws_what_the_streams_of_environments_draw():
    streams, chance = Streams(torch.from_numpy(SEEDS), ACTION_STREAM), chance_of(SEEDS)
    rng = np.random.default_rng(0)
    for step in range(40):
        told = rng.random((len(SEEDS), 4), np.float32)
        decisions, after = drawn(told, chance)
        assert decisions.action.tolist() == sampled(torch.from_numpy(told), streams.uniform()).tolist()
        assert after[:, 1].tolist() == [step + 1] * len(SEEDS) and np.array_equal(after[:, 0], chance[:, 0])
        assert chance[:, 1].tolist() == [step] * len(SEEDS)
        chance = after


def test_actions_are_drawn_by_probabilities_that_need_not_sum_to_one():
    chance = chance_of(np.arange(20_000))
    decisions, after = drawn(np.array([[3.0, 1.0, 0.0, 2.0]]).repeat(20_000, 0), chance)
    share = np.bincount(decisions.action, minlength=4) / 20_000
    assert share[2] == 0
    np.testing.assert_allclose(share, [1 / 2, 1 / 6, 0, 1 / 3], atol=4 * 0.5 / np.sqrt(20_000))
    later, _ = drawn(np.full((20_000, 4), 0.25), after)
    first, _ = drawn(np.full((20_000, 4), 0.25), chance)
    assert abs((later.action == first.action).mean() - 0.25) < 4 * 0.5 / np.sqrt(20_000)  # the next draw is another


def test_what_has_one_possible_action_is_certain():
    told = np.array([[0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.0, 0.3]], np.float32)
    decisions, _ = drawn(told, chance_of(np.arange(3)), np.array([1.0, 2.0, 3.0]))
    assert decisions.certain.tolist() == [True, False, True]
    assert decisions.action[[0, 2]].tolist() == [1, 3]
    assert decisions.value.tolist() == [1, 2, 3] and decisions.probabilities is told
