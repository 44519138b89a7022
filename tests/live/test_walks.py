"""Agents of several scenes in the room: each scene's own layers decide there; which agents can be compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.agents.agent import FEATURES, Decisions
from clearway.agents.by_features import FeatureAgent
from clearway.errors import EncoderError, RunError
from clearway.learn.load import TrainedNetwork
from clearway.learn.run_record import record_of
from clearway.live.conditions import Condition, Perturbations
from clearway.live.episodes import LiveProtocol
from clearway.live.live_room import LiveRoom
from clearway.live.walks import LiveScene, check_alike, encoder_of, finish_live, stages, walk_setting
from clearway.perception import depth_grid
from clearway.perception.encode import encoder_from_record
from clearway.rooms.camera import eye_view
from clearway.rooms.render import studio
from clearway.scenes.actions import Action
from clearway.views.seen import record_for_takes
from clearway.world.world import World, make_world
from helpers.agents import after_poses
from helpers.made import corridor_scene
from helpers.small_live import state_at
from helpers.small_runs import small_request, small_world, trained_network

SURE = 1_000.0  # of an action's score


@pytest.fixture
def agent() -> TrainedNetwork:
    """Trained for a moment on a corridor and a grid."""
    return trained_network(updates=3)


def histories(world: World, target: torch.Tensor) -> torch.Tensor:
    """For each target a history (B, K) of states of its scene."""
    first = world.scene_offset[world.target_scene[target]]
    return first[:, None] + torch.randint(20, (len(target), 4), generator=torch.Generator().manual_seed(0))


def by_features(agent: FeatureAgent, history: np.ndarray, target: np.ndarray) -> Decisions:
    """What an agent does after features (B, K, F), the first of which begin the episode, to targets (B, F)."""
    memory = agent.reset({FEATURES: target}, np.arange(len(target)))
    for step in range(history.shape[1]):
        decisions, memory = agent.act({FEATURES: history[:, step]}, memory)
    return decisions


def test_the_agent_of_pictures_is_the_evaluated_one_in_every_scene(agent) -> None:
    world = small_world()
    features = world.features
    assert features is not None
    for scene, targets in enumerate(([0, 1, 2], [3, 4])):
        target = torch.tensor(targets * 3)
        history = histories(world, target)
        expected = after_poses(agent.on_poses(world), world, history, target)
        seen = features[history].numpy(), features[world.target_state[target]].numpy()
        found, other = (by_features(FeatureAgent(agent.in_scene(own)), *seen) for own in (scene, 1 - scene))
        np.testing.assert_allclose(found.probabilities, expected.probabilities, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(found.value, expected.value, rtol=1e-4, atol=1e-5)
        np.testing.assert_array_equal(found.action, expected.action)
        assert not np.allclose(other.probabilities, expected.probabilities, rtol=1e-2)


def resolved(live: LiveRoom, names: tuple[str, ...]) -> tuple[list[LiveRoom], TrainedNetwork]:
    """The room under several names, and an agent that walks ahead in the first and turns right in the others."""
    scenes = [replace(live.scene, name=name) for name in names]
    targets = {name: (state_at(live.scene, 1.75, 1.75, 0),) for name in names}
    request = small_request(scenes=scenes, targets=targets)
    trainer = request.trainer()
    bias = trainer.network.output_bias.data
    bias[0, Action.MOVE_FORWARD] = SURE
    bias[1:, Action.TURN_RIGHT] = SURE
    rooms = [replace(live, scene=scene) for scene in scenes]
    return rooms, TrainedNetwork(record_of(request), trainer.network, trainer.feature_map, 0)


def test_in_every_scene_its_own_layers_decide(live) -> None:
    rooms, agent = resolved(live, ("first", "second"))
    assert live.scene.encoder is not None
    encoder = encoder_from_record(live.scene.encoder)
    protocol = LiveProtocol(2, 3, 0, "sampled")
    with studio(live.model, eye_view(), workers=1) as camera:
        places = []
        for room in rooms:
            name = room.scene.name
            world = make_world([room.scene], {name: agent.record.targets[name]})
            places.append(LiveScene(room, world, encoder, camera))
        outcome = walk_setting(places, {"agent": agent}, Condition("none", Perturbations()), protocol)
    ahead, turning = outcome.tables["agent"]
    for walk in ahead.walks:
        assert (np.diff(walk[:, 2]) == 0).all()
    for walk in turning.walks:
        assert (np.diff(walk[:, 2]) % 360 == 90).all()


def test_finished_results_are_written_where_links_lead(tmp_path) -> None:
    """As other results of a run are."""
    kept, run = tmp_path / "kept.json", tmp_path / "run"
    run.mkdir()
    kept.write_text("old")
    (run / "live.json").symlink_to(kept)
    for name in ("live.part.json", "live.part.md"):
        (run / name).write_text("new")
    finish_live(run)
    assert kept.read_text() == (run / "live.md").read_text() == "new"
    assert {path.name for path in run.iterdir()} == {"live.json", "live.md"}


def test_agents_that_differ_in_what_they_walk_to_are_not_compared(agent) -> None:
    record = agent.record
    shorter = replace(record, learner=replace(record.learner, history_length=2))  # its memory is its own
    check_alike({"one": agent, "same": agent, "shorter": replace(agent, record=shorter)})
    corridor, grid = record.scenes
    others = (
        replace(record, scenes=(corridor, replace(grid, targets=(5, 21)))),
        replace(record, scenes=(corridor, replace(grid, digest="0" * 16))),
    )
    for other in others:
        with pytest.raises(RunError, match="differ in their scenes or targets"):
            check_alike({"one": agent, "other": replace(agent, record=other)})


def test_an_encoder_of_depth_is_refused_before_a_room_is_built(agent) -> None:
    scene = replace(corridor_scene(5), encoder=depth_grid.find_record())
    with (
        pytest.raises(EncoderError, match=r"corridor: its encoder depth-grid sees depth, and .*live walks.*grid"),
        stages([scene], {"corridor": (0,)}, "pose"),
    ):
        pass
    with pytest.raises(
        EncoderError, match="corridor has no features by a known encoder, by which pictures of live walks"
    ):
        encoder_of(replace(scene, encoder=None))


def test_perturbed_takes_are_not_encoded_by_what_sees_depth() -> None:
    scene = replace(corridor_scene(5), encoder=depth_grid.find_record())
    with pytest.raises(EncoderError, match=r"sees depth, and perturbed takes are in colour. Leave perturb out$"):
        record_for_takes(scene)
