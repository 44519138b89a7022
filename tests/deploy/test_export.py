"""Exported files compute what the trained network computes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from torch.nn.functional import interpolate

from clearway.deploy.card import card_from_json
from clearway.deploy.export import export_onnx
from clearway.deploy.from_run import RunAgent, load_run_in_scene, picture_encoder
from clearway.deploy.onnx_file import OnnxAgent, read_onnx
from clearway.deploy.onnx_graph import resize_weights
from clearway.errors import DeployError, EncoderError, RunError
from clearway.learn.load import run_world
from clearway.learn.train import train
from clearway.perception import depth_grid, encoder_from_record
from clearway.scenes.sensors import RGB
from clearway.scenes.thor_v1 import write_scene
from helpers.agents import after_poses
from helpers.made import grid_scene, with_depth
from helpers.small_eyes import seen_by_eyes
from helpers.small_runs import small_learner, small_request

CLOSE = {"rtol": 0, "atol": 1e-5}


def histories(rows: int, states: int) -> tuple[np.ndarray, np.ndarray]:
    """Histories (B, 4) and targets (B,) of any states."""
    rng = np.random.default_rng(rows)
    return rng.integers(0, states, (rows, 4)), rng.integers(0, states, rows)


@pytest.mark.parametrize("rows", [1, 2, 7, 64])
def test_the_policy_alone_equals_the_network_in_pytorch(deployed, policy_file, rows) -> None:
    """The whole network with its scene switch is the reference, not the module that was exported."""
    features = deployed.scenes[1].features
    history, target = histories(rows, len(features))
    agent = deployed.chosen.trained
    prepared = agent.feature_map(torch.from_numpy(features))
    with torch.inference_mode():
        scores, value = agent.network(prepared[history], prepared[target], torch.ones(rows, dtype=torch.int64))
    session = onnxruntime.InferenceSession(policy_file)
    found = session.run(["probabilities", "value"], {"history": features[history], "target": features[target]})
    np.testing.assert_allclose(found[0], torch.softmax(scores, 1).numpy(), **CLOSE)
    scale = agent.record.learner.reward_scale
    np.testing.assert_allclose(found[1] * scale, value[:, None].numpy(), **CLOSE)
    assert np.ptp(found[0], axis=1).max() > 0.02  # trained enough that the actions differ


@pytest.mark.slow
def test_an_agent_with_eyes_is_a_file_too(tmp_path) -> None:
    scenes = seen_by_eyes(tmp_path / "eyes", grid_scene(0, width=4, depth=3, name="attic"))
    write_scene(scenes[0], tmp_path / "attic.h5")
    paths = {"attic": tmp_path / "attic.h5"}
    learner = replace(small_learner(frames=400), centre_features=True)
    request = small_request(scenes=scenes, paths=paths, targets={"attic": (5, 22)}, learner=learner)
    train(request, tmp_path / "run")
    chosen = load_run_in_scene(tmp_path / "run")
    export_onnx(chosen, tmp_path / "agent.onnx")
    in_torch, in_file = RunAgent(chosen), OnnxAgent(read_onnx(tmp_path / "agent.onnx"))
    pictures = scenes[0].observations[:]
    (first, _), (second, _) = (
        agent.act({RGB: pictures[7:9]}, agent.reset({RGB: pictures[[5, 22]]}, np.arange(2)))
        for agent in (in_torch, in_file)
    )
    np.testing.assert_allclose(second.probabilities, first.probabilities, **CLOSE)
    assert in_file.card.normalisation["pixels"]["height"] == 48


@pytest.mark.parametrize("rows", [1, 3, 32])
def test_policy_with_encoder_equals_the_evaluated_agent(deployed, rows) -> None:
    """Walked from pictures, step by step, against the policy from tables that `clearway evaluate` judges.

    Values are in units of the reward, as the viewer shows them, not of what the learner made of it.
    """
    chosen, scenes = deployed.chosen, deployed.scenes
    scale = chosen.trained.record.learner.reward_scale
    assert scale != 1
    world = run_world(chosen.trained.record, scenes)
    rng = np.random.default_rng(rows)
    states = rng.integers(0, len(deployed.pictures), (6, rows))
    targets = rng.integers(0, 2, rows)
    agent, known_goal = OnnxAgent(read_onnx(deployed.agent)), np.array([3, 9])[targets]
    memory = agent.reset({RGB: deployed.pictures[known_goal]}, np.arange(rows))
    (empty,) = [name for name, values in memory.items() if values.shape == (rows, 4, agent.card.feature_count)]
    memory = {**memory, empty: np.full_like(memory[empty], np.nan)}  # a start must not look at it
    first = int(world.scene_offset[1])
    evaluated = chosen.trained.on_poses(world)
    for step in range(6):
        found, memory = agent.act({RGB: deployed.pictures[states[step]]}, memory)
        known = states[np.clip(np.arange(step - 3, step + 1), 0, None)].T  # (B, 4), the first repeated
        expected = after_poses(evaluated, world, torch.from_numpy(known) + first, torch.from_numpy(targets) + 2)
        np.testing.assert_allclose(found.probabilities, expected.probabilities, **CLOSE)
        np.testing.assert_allclose(found.value * scale, expected.value * scale, **CLOSE)


@pytest.mark.parametrize("size", [(12, 16), (16, 20), (37, 21), (240, 320), (1, 1)])
def test_pictures_of_any_size_are_prepared_as_the_encoder_does(deployed, size) -> None:
    pictures = np.random.default_rng(0).integers(0, 256, (3, *size, 3), np.uint8)
    agent = OnnxAgent(read_onnx(deployed.agent))
    begin = agent.reset({RGB: pictures}, np.arange(3))
    _, after = agent.act({RGB: pictures}, begin)
    expected = encoder_from_record(deployed.scenes[1].encoder).encode(pictures)
    np.testing.assert_allclose(begin["target"], expected, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(after["history"], np.repeat(expected[:, None], 4, axis=1), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(("given", "wanted"), [(300, 128), (400, 128), (5, 5), (3, 8), (1, 4), (9, 1)])
def test_resizing_is_pytorch_s(given, wanted) -> None:
    row = torch.rand(1, 1, 1, given, generator=torch.Generator().manual_seed(0))
    expected = interpolate(row, (1, wanted), mode="bilinear", antialias=True, align_corners=False)
    torch.testing.assert_close(row[0, 0] @ resize_weights(given, wanted).T, expected[0, 0], rtol=1e-5, atol=1e-6)


def test_only_where_an_episode_starts_is_the_history_filled(deployed) -> None:
    agent = OnnxAgent(read_onnx(deployed.agent))
    history = np.arange(2 * 4 * 16, dtype=np.float32).reshape(2, 4, 16)
    begin = agent.reset({RGB: deployed.pictures[:2]}, np.arange(2))
    memory = {**begin, "begun": np.array([False, True]), "history": history}
    after = agent.act({RGB: deployed.pictures[:2]}, memory)[1]["history"]
    np.testing.assert_allclose(after[0], np.repeat(after[0, -1:], 4, axis=0))
    np.testing.assert_array_equal(after[1, :3], history[1, 1:])
    assert not np.isin(after[:, -1], history).any()


def test_the_card_says_what_the_agent_is(deployed) -> None:
    card = OnnxAgent(read_onnx(deployed.agent)).card
    assert (card.scene, card.takes_pictures, card.history_length, card.feature_count) == ("cellar", True, 4, 16)
    assert card.actions == ("move forward", "turn right", "turn left", "move backward")
    assert card.picture_size == (12, 16)
    colour = {"name": "rgb", "shape": [12, 16, 3], "dtype": "uint8", "unit": "", "low": 0, "high": 255}
    assert card.observation == colour
    assert card.encoder["identity"] == deployed.scenes[1].encoder.identity
    assert card.normalisation["pixels"]["height"] == 16 and card.normalisation["pixels"]["width"] == 20
    assert card.normalisation["features"]["directions"] == 12
    assert card.training["seed"] == 3


def test_the_card_of_a_policy_alone(deployed, policy_file) -> None:
    alone = OnnxAgent(read_onnx(policy_file)).card
    assert alone.encoder["identity"] == deployed.scenes[1].encoder.identity
    assert (alone.takes_pictures, alone.normalisation["pixels"]) == (False, None)


def test_a_file_is_a_sound_model_that_names_no_place_on_this_machine(deployed) -> None:
    onnx.checker.check_model(onnx.load(deployed.agent), full_check=True)
    content = deployed.agent.read_bytes()
    assert b".py" not in content
    assert str(Path.home()).encode() not in content and str(deployed.run.parent).encode() not in content


def test_the_scene_is_chosen_by_name_and_is_the_first_otherwise(deployed) -> None:
    assert load_run_in_scene(deployed.run).scene.name == "attic"
    assert load_run_in_scene(deployed.run, "cellar").index == 1
    with pytest.raises(DeployError, match=r"not trained on a scene den\. Name one of attic, cellar"):
        load_run_in_scene(deployed.run, "den")
    with pytest.raises(RunError, match="no run here"):
        load_run_in_scene(deployed.run.parent)


def test_an_encoder_of_depth_is_not_deployed(deployed) -> None:
    scene = replace(deployed.chosen.scene, encoder=depth_grid.find_record())
    with pytest.raises(EncoderError, match="depth-grid sees depth, and deployed agents take colour pictures"):
        picture_encoder(replace(deployed.chosen, scene=scene))


def test_the_card_of_an_agent_that_sees_depth_says_so(deployed) -> None:
    scene = with_depth(replace(deployed.chosen.scene, encoder=depth_grid.find_record()))
    card = replace(deployed.chosen, scene=scene).card(None)
    depth = {"name": "depth", "shape": [12, 16], "dtype": "float32", "unit": "m", "low": 0, "high": 20}
    assert card_from_json(card.to_json(), "here").observation == depth


def test_a_card_of_before_observations_were_described_is_read(deployed) -> None:
    kept = json.loads(OnnxAgent(read_onnx(deployed.agent)).card.to_json()) | {"format_version": 1}
    del kept["observation"]
    assert card_from_json(json.dumps(kept), "here").observation is None
