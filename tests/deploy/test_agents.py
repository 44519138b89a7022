"""Deployed agents keep to the protocol of all agents, and walk the evaluation's episodes as their network does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.agents.agent import FEATURES, Agent, Observation
from clearway.agents.by_features import FeatureAgent
from clearway.agents.selection import Argmax
from clearway.deploy.from_run import RunAgent
from clearway.deploy.onnx_file import OnnxAgent, read_onnx
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.learn.load import run_world
from clearway.scenes.sensors import RGB
from clearway.world.world import World, make_world
from helpers.agents import check_agent, equal

EPISODES, STEPS = 5, 6
COUNTS = ("steps", "collisions", "reached", "shortest_path_steps", "zone_steps", "looped")


def seen(deployed, poses: np.ndarray) -> Observation:
    return {RGB: deployed.pictures[poses], FEATURES: deployed.scenes[1].features[poses]}


def walked(deployed) -> tuple[list[Observation], Observation]:
    poses = np.random.default_rng(0).integers(0, len(deployed.pictures), (STEPS, EPISODES))
    return [seen(deployed, at) for at in poses], seen(deployed, np.array([3, 9, 9, 3, 3]))


def made(name: str, deployed, policy_file: Path) -> Agent:
    return {
        "PyTorch": lambda: RunAgent(deployed.chosen),
        "PyTorch by features": lambda: FeatureAgent(deployed.chosen.policy),
        "onnxruntime": lambda: OnnxAgent(read_onnx(deployed.agent)),
        "onnxruntime by features": lambda: OnnxAgent(read_onnx(policy_file)),
    }[name]()


NAMES = ("PyTorch", "PyTorch by features", "onnxruntime", "onnxruntime by features")


@pytest.mark.parametrize("name", NAMES)
def test_every_deployed_agent_keeps_to_the_protocol(deployed, policy_file, name) -> None:
    agent = made(name, deployed, policy_file)
    assert agent.sees == ((FEATURES,) if "features" in name else (RGB,))
    check_agent(agent, *walked(deployed))
    check_agent(Argmax(agent), *walked(deployed), draws=False)


def test_all_of_them_do_the_same(deployed, policy_file) -> None:
    observations, target = walked(deployed)
    told, taken = [], []
    for name in NAMES:
        agent = made(name, deployed, policy_file)
        memory = agent.reset({one: target[one] for one in agent.sees}, np.arange(EPISODES))
        for observation in observations:
            decisions, memory = agent.act({one: observation[one] for one in agent.sees}, memory)
            told.append(np.c_[decisions.probabilities, decisions.value])
            taken.append(decisions.action)
    told, taken = np.reshape(told, (len(NAMES), -1)), np.reshape(taken, (len(NAMES), -1))
    np.testing.assert_allclose(told, told[:1].repeat(len(NAMES), 0), atol=1e-4)
    assert (taken == taken[0]).all() and len(set(taken[0].tolist())) == 4


def test_features_of_a_target_that_are_known_are_not_made_again(deployed) -> None:
    agent, known = OnnxAgent(read_onnx(deployed.agent)), deployed.scenes[1].features[[3, 9]]
    other = agent.reset({RGB: deployed.pictures[[0, 0]], FEATURES: known}, np.arange(2))
    np.testing.assert_array_equal(other["target"], known)
    own = agent.reset({RGB: deployed.pictures[[3, 9]]}, np.arange(2))
    np.testing.assert_allclose(own["target"], known, rtol=1e-4, atol=1e-4)
    assert not equal(own, agent.reset({RGB: deployed.pictures[[0, 0]]}, np.arange(2)))


@pytest.fixture(scope="module")
def cellar(deployed) -> World:
    return make_world([deployed.scenes[1]], {"cellar": deployed.chosen.trained.record.targets["cellar"]})


def evaluated(deployed, **settings) -> EpisodeTable:
    """The network's own episodes from tables, in both scenes of its run."""
    world = run_world(deployed.chosen.trained.record, deployed.scenes)
    return run_episodes(world, deployed.chosen.trained.on_poses(world), **settings)


@pytest.mark.parametrize("selection", ["sampled", "argmax", "argmax-untried"])
@pytest.mark.parametrize("name", NAMES)
def test_evaluated_on_the_grid_they_walk_the_episodes_of_the_network(
    deployed, policy_file, cellar, name, selection
) -> None:
    """From the same starts, and as the draws are the same, step for step."""
    settings = {"episodes_per_target": 6, "step_limit": 50, "seed": 3, "selection": selection, "record": True}
    found = run_episodes(cellar, made(name, deployed, policy_file), scenes=deployed.scenes[1:], **settings)
    whole = evaluated(deployed, **settings)
    first, there = deployed.scenes[0].state_count, whole.target >= 2
    assert np.array_equal(found.start, whole.start[there] - first)
    for column in COUNTS:
        assert np.array_equal(getattr(found, column), getattr(whole, column)[there]), column
    walks = [walk for walk, own in zip(whole.trajectories, there, strict=True) if own]
    for walk, expected in zip(found.trajectories, walks, strict=True):
        assert walk.actions.tolist() == expected.actions.tolist()
        assert np.array_equal(walk.states, expected.states - first)
    if selection != "argmax":  # by which an agent of so few frames may do one thing always
        assert len({walk.actions.tobytes() for walk in walks}) > 1, "all walks are alike: this shows nothing"


@pytest.mark.slow
def test_a_circle_is_found_by_pictures_too(deployed, cellar) -> None:
    """An agent of pictures that is certain of its actions is not walked to the cap, and its counts are the same."""
    settings = {"scenes": deployed.scenes[1:], "selection": "argmax", "episodes_per_target": 8, "step_limit": 401}
    skipped = run_episodes(cellar, OnnxAgent(read_onnx(deployed.agent)), **settings)
    every = run_episodes(cellar, OnnxAgent(read_onnx(deployed.agent)), record=True, **settings)
    assert skipped.looped.any()
    for column in COUNTS:
        assert np.array_equal(getattr(skipped, column), getattr(every, column)), column
