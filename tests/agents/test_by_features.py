"""A network by features or pictures in one scene."""

import numpy as np
import pytest
import torch

from clearway.agents.agent import FEATURES
from clearway.agents.by_features import FeatureAgent
from clearway.agents.encoded import PICTURES_AT_ONCE
from clearway.perception import depth_grid
from clearway.scenes.scene import EncoderRecord
from clearway.scenes.sensors import DEPTH, RGB
from helpers.agents import check_agent
from helpers.small_runs import FEATURES as FEATURE_COUNT
from helpers.small_runs import trained_network

RNG = np.random.default_rng(0)
PICTURES = RNG.integers(0, 256, (2 * PICTURES_AT_ONCE + 7, 3, 4, 3)).astype(np.uint8)


class Blurred:
    """An encoder that takes sums of pixels; it notes how many pictures it was given at once."""

    record = EncoderRecord("blurred", "blurred-1", {})
    feature_count = FEATURE_COUNT

    def __init__(self) -> None:
        self.asked: list[int] = []
        self.weights = np.random.default_rng(1).normal(size=(36, FEATURE_COUNT)).astype(np.float32) / 900

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        self.asked.append(len(pictures))
        return (pictures.reshape(len(pictures), -1).astype(np.float32) - 128) @ self.weights


@pytest.fixture(scope="module")
def policy():
    return trained_network().in_scene(0)


def test_it_keeps_to_the_protocol_with_its_encoder(policy):
    agent = FeatureAgent(policy, Blurred())
    assert agent.sees == (RGB,)
    seen = [{RGB: PICTURES[5 * step : 5 * step + 5]} for step in range(6)]
    check_agent(agent, seen, {RGB: PICTURES[-5:]})


def test_by_pictures_it_does_what_it_does_by_their_features(policy):
    encoder, seeds = Blurred(), np.arange(5)
    by_pictures, by_features = FeatureAgent(policy, encoder), FeatureAgent(policy)
    assert by_features.sees == (FEATURES,)
    goals = PICTURES[-5:]
    memory, other = by_pictures.reset({RGB: goals}, seeds), by_features.reset({FEATURES: encoder.encode(goals)}, seeds)
    for step in range(6):
        pictures = PICTURES[5 * step : 5 * step + 5]
        found, memory = by_pictures.act({RGB: pictures}, memory)
        expected, other = by_features.act({FEATURES: encoder.encode(pictures)}, other)
        np.testing.assert_allclose(found.probabilities, expected.probabilities, rtol=1e-5)
        np.testing.assert_allclose(found.value, expected.value, rtol=1e-4, atol=1e-6)
        assert found.action.tolist() == expected.action.tolist()


def test_it_remembers_the_last_features_and_the_first_fill_the_history(policy):
    agent, features = FeatureAgent(policy), RNG.normal(size=(7, 2, FEATURE_COUNT)).astype(np.float32)
    goal = RNG.normal(size=(2, FEATURE_COUNT)).astype(np.float32)
    memory = agent.reset({FEATURES: goal}, np.arange(2))
    for step in range(7):
        found, memory = agent.act({FEATURES: features[step]}, memory)
        history = features[np.clip(np.arange(step - 3, step + 1), 0, None)].swapaxes(0, 1)
        with torch.no_grad():
            expected, value = policy(torch.from_numpy(history), torch.from_numpy(goal))
        np.testing.assert_allclose(found.probabilities, expected.numpy(), rtol=1e-5)
        np.testing.assert_allclose(found.value, value[:, 0].numpy(), rtol=1e-4, atol=1e-6)


def test_features_of_targets_that_are_known_are_not_made_again(policy):
    encoder = Blurred()
    agent, features = FeatureAgent(policy, encoder), encoder.encode(PICTURES[:3])
    encoder.asked.clear()
    known = agent.reset({RGB: PICTURES[3:6], FEATURES: features}, np.arange(3))
    assert not encoder.asked
    np.testing.assert_array_equal(known["target"], features)
    made = agent.reset({RGB: PICTURES[:3]}, np.arange(3))
    assert encoder.asked == [3]
    np.testing.assert_allclose(made["target"], features, rtol=1e-5, atol=1e-6)


def test_an_encoder_gets_a_few_pictures_at_once_and_each_keeps_its_own_features(policy):
    encoder = Blurred()
    found = FeatureAgent(policy, encoder).reset({RGB: PICTURES}, np.arange(len(PICTURES)))["target"]
    assert encoder.asked == [PICTURES_AT_ONCE, PICTURES_AT_ONCE, 7]
    np.testing.assert_allclose(found, Blurred().encode(PICTURES), rtol=1e-5, atol=1e-6)


def test_it_sees_by_the_sensor_that_its_encoder_takes(policy):
    encoder = Blurred()
    encoder.record = depth_grid.find_record()
    assert FeatureAgent(policy, encoder).sees == (DEPTH,)
