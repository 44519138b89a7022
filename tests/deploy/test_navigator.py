"""A robot's ten lines: pictures in, actions out."""

import io
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

import clearway
from clearway.deploy.navigator import episode_seed, episode_seeds, open_agent
from clearway.errors import DeployError
from clearway.learn.load import run_world
from clearway.reward import COLLISION_AWARE
from clearway.world.navigation import Navigation
from helpers.agents import after_poses, equal
from helpers.imported import imported_by
from helpers.serving import picture_bytes
from helpers.sums import Sums, plain


def values(navigator: clearway.Navigator, levels: list[int]) -> list[float]:
    return [navigator.act(plain(level)).value for level in levels]


def test_the_first_picture_fills_the_history_and_later_ones_push_it_out() -> None:
    navigator = clearway.Navigator(Sums())
    navigator.set_target(plain(2))
    assert values(navigator, [1, 10, 20, 30, 40]) == [2000 + total for total in (4, 13, 32, 61, 100)]
    navigator.set_target(plain(3))  # begins an episode
    assert values(navigator, [5, 6]) == [3020.0, 3021.0]


@pytest.mark.parametrize("source", ["run", "agent"])
def test_decisions_are_the_evaluated_agent_s_along_an_episode(deployed, source) -> None:
    """Through the environment that trained it: the histories are the environment's own."""
    import torch

    world = run_world(deployed.chosen.trained.record, deployed.scenes)
    agent, first = deployed.chosen.trained.on_poses(world), int(world.scene_offset[1])
    navigation = Navigation(world, COLLISION_AWARE, torch.zeros(1, dtype=torch.int64))
    navigation.reset(target=torch.tensor([2]), start=torch.tensor([first + 30]))
    navigator = clearway.Navigator(getattr(deployed, source), scene="cellar", seed=1)
    navigator.set_target(deployed.pictures[3])
    for _ in range(12):
        action, probabilities, value = navigator.act(deployed.pictures[int(navigation.state) - first])
        expected = after_poses(agent, world, navigation.history, navigation.target)
        np.testing.assert_allclose(probabilities, expected.probabilities[0], atol=1e-5)
        np.testing.assert_allclose(value, expected.value[0], atol=1e-4)
        assert isinstance(value, float)
        navigation.step(torch.tensor([int(action)]))


def test_a_file_without_encoder_takes_features(deployed, policy_file) -> None:
    """And agrees with the one that holds the encoder."""
    alone, whole = (clearway.Navigator(path, seed=0) for path in (policy_file, deployed.agent))
    alone.set_target(deployed.scenes[1].features[3])
    whole.set_target(deployed.pictures[3])
    for state in (7, 8, 30):
        found, expected = alone.act(deployed.scenes[1].features[state]), whole.act(deployed.pictures[state])
        np.testing.assert_allclose(found.probabilities, expected.probabilities, atol=1e-5)
        assert found.action == expected.action
    with pytest.raises(DeployError, match=r"given uint8 \(12, 16, 3\), expected features, float32 \(16,\)"):
        alone.act(deployed.pictures[0])
    with pytest.raises(DeployError, match="NaN or Inf"):
        alone.act(np.full(16, np.nan, np.float32))
    with pytest.raises(DeployError, match="NaN or Inf"):
        alone.act(np.full(16, 1e300))  # more than float32 holds


def test_actions_are_drawn_by_their_probabilities_and_a_seed_repeats() -> None:
    def drawn(seed: int, count: int = 40) -> list[int]:
        navigator = clearway.Navigator(Sums(), seed=seed)
        navigator.set_target(plain(0))
        return [int(navigator.act(plain(0)).action) for _ in range(count)]

    assert drawn(4) == drawn(4) != drawn(5)
    shares = np.bincount(drawn(4, 2000), minlength=4) / 2000
    np.testing.assert_allclose(shares, [0.1, 0.2, 0.3, 0.4], atol=0.04)
    certain = clearway.Navigator(Sums(), selection="argmax")
    certain.set_target(plain(0))
    assert {certain.act(plain(0)).action.name for _ in range(9)} == {"MOVE_BACKWARD"}


def test_the_most_probable_action_is_the_first_among_equals() -> None:
    class Undecided(Sums):
        def act(self, observation, state):
            decisions, after = super().act(observation, state)
            return replace(decisions, probabilities=np.array([[0.1, 0.4, 0.4, 0.1]], np.float32)), after

    navigator = clearway.Navigator(Undecided(), selection="argmax")
    navigator.set_target(plain(0))
    assert {navigator.act(plain(0)).action.name for _ in range(9)} == {"TURN_RIGHT"}


def test_episodes_of_one_navigator_draw_for_themselves_and_repeat_in_their_order() -> None:
    def drawn(navigator: clearway.Navigator) -> list[list[int]]:
        found = []
        for _ in range(3):
            navigator.set_target(plain(0))
            found.append([int(navigator.act(plain(0)).action) for _ in range(20)])
        return found

    first = drawn(clearway.Navigator(Sums(), seed=4))
    assert first == drawn(clearway.Navigator(Sums(), seed=4))
    assert first[0] != first[1] != first[2]
    unseeded = [drawn(clearway.Navigator(Sums())) for _ in range(2)]
    assert unseeded[0] != unseeded[1]


def test_threads_may_share_a_navigator() -> None:
    """Every call sees the history that the call before it left: no picture is lost, none is counted twice."""
    navigator = clearway.Navigator(Sums())
    navigator.set_target(plain(0))
    navigator.act(plain(1))
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda level: navigator.act(plain(level)).value, [1] * 400))
    assert found == [4.0] * 400

    states = []

    class Watched(Sums):
        def act(self, observation, state):
            decisions, after = super().act(observation, state)
            states.append((state, after))
            return decisions, after

    watched = clearway.Navigator(Watched())
    watched.set_target(plain(0))
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda level: watched.act(plain(level)), range(1, 101)))
    assert len(states) == 100
    assert all(equal(later[0], earlier[1]) for earlier, later in pairwise(states))


PICTURE = np.zeros((4, 4, 3), np.uint8)


def cut_off() -> Image.Image:
    """A picture of a file that was cut off, which Pillow notices once its pixels are asked for."""
    content = picture_bytes(np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8), "JPEG")
    return Image.open(io.BytesIO(content[: len(content) // 2]))


@pytest.mark.parametrize(
    ("picture", "part"),
    [
        (PICTURE.astype(np.float32), r"float32 \(4, 4, 3\), expected uint8"),
        (PICTURE[..., 0], r"uint8 \(4, 4\), expected uint8 \(height, width, 3\)"),
        (np.zeros((4, 4, 4), np.uint8), r"\(4, 4, 4\)"),
        (np.zeros((0, 4, 3), np.uint8), r"\(0, 4, 3\)"),
        (PICTURE[None], r"\(1, 4, 4, 3\)"),
        ("picture.png", "the picture is a text. Give its pixels"),
        (None, "Give an RGB picture"),
        ([[1, 2], [3]], "what is seen is no picture .*Give an array"),
        (np.zeros((1, 4097, 3), np.uint8), "4097 x 1 pixels, expected at most 4096"),
        (Image.new("L", (5, 5)), r"uint8 \(5, 5\)"),
        (cut_off(), r"what is seen is no picture \(image file is truncated.*Give an array"),
    ],
)
def test_what_is_no_picture_is_refused(picture, part) -> None:
    navigator = clearway.Navigator(Sums())
    for give in (navigator.set_target, navigator.act):
        with pytest.raises(DeployError, match=part):
            give(picture)


def test_a_pillow_picture_is_taken() -> None:
    navigator = clearway.Navigator(Sums())
    navigator.set_target(Image.new("RGB", (8, 6)))
    assert navigator.act(Image.new("RGB", (8, 6), (9, 9, 9))).value == 36


def test_an_agent_of_one_scene_takes_the_aspect_of_its_training_alone() -> None:
    navigator = clearway.Navigator(Sums())
    navigator.set_target(plain(5, (600, 800)))
    with pytest.raises(DeployError, match=r"those of the training 1\.33 \(4 x 3\), .*Crop them to 4 x 3"):
        navigator.set_target(plain(5, (3, 9)))
    unknown = Sums()
    unknown.card = replace(unknown.card, picture_size=None)
    clearway.Navigator(unknown).set_target(plain(5, (3, 9)))


def test_without_a_target_there_is_nothing_to_do() -> None:
    with pytest.raises(DeployError, match=r"no target yet\. Call set_target first"):
        clearway.Navigator(Sums()).act(plain(1))


def test_sources_that_cannot_be_used(deployed, tmp_path) -> None:
    with pytest.raises(DeployError, match=r"nothing\.onnx: cannot be read"):
        clearway.Navigator(tmp_path / "nothing.onnx")
    with pytest.raises(DeployError, match=r"is for scene cellar, not attic\. Export the run with --scene attic"):
        clearway.Navigator(deployed.agent, scene="attic")
    with pytest.raises(DeployError, match=r"the agent is for scene attic, not kitchen\. Open the agent for kitchen"):
        clearway.Navigator(Sums(), scene="kitchen")
    assert clearway.Navigator(Sums(), scene="attic").card.scene == "attic"
    with pytest.raises(DeployError, match=r"selection is 'best'\. Choose one of sampled, argmax"):
        clearway.Navigator(Sums(), selection="best")
    assert open_agent(str(deployed.agent), "cellar").card.scene == "cellar"


@pytest.mark.parametrize("seed", [-1, "x", 1.5, True, np.array([1])])
def test_seeds_that_are_none_are_refused(seed) -> None:
    with pytest.raises(DeployError, match=r"seed is .*, expected a whole number from 0"):
        clearway.Navigator(Sums(), seed=seed)
    clearway.Navigator(Sums(), seed=np.int64(3))


def test_a_robot_needs_neither_pytorch_nor_the_learner(deployed) -> None:
    statement = f"""
import clearway, numpy
navigator = clearway.Navigator({str(deployed.agent)!r})
navigator.set_target(numpy.zeros((6, 8, 3), numpy.uint8))
navigator.act(numpy.zeros((6, 8, 3), numpy.uint8))
"""
    loaded = imported_by(statement)
    assert {"clearway.deploy.onnx_session", "clearway.deploy.navigator"} <= loaded
    assert not loaded & {"torch", "gymnasium", "onnx", "onnxruntime", "h5py", "scipy", "transformers", "clearway.model"}
    ours = {name for name in loaded if name.startswith("clearway.")}
    elsewhere = {"learn", "envs", "perception", "model", "evaluation", "live"}
    assert not [name for name in ours if name.split(".")[1] in elsewhere]
    assert imported_by("import clearway") & {"numpy", "clearway.deploy"} == set()


@pytest.mark.parametrize("seed", [0, 7, 2**64 - 1])
def test_an_episode_s_seed_is_known_without_those_before_it(seed) -> None:
    seeds = episode_seeds(seed)
    assert [next(seeds).tolist() for _ in range(20)] == [episode_seed(seed, number).tolist() for number in range(20)]
