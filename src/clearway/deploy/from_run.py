"""An agent for one scene out of a run folder: its card, and `RunModel`, which computes it with PyTorch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch

from clearway.deploy.card import Card
from clearway.deploy.graph import PolicyGraph
from clearway.deploy.model import Step
from clearway.deploy.onnx_file import shifted
from clearway.errors import DeployError
from clearway.learn.learner import OnFeatures
from clearway.learn.load import Agent, load_agent, run_scenes
from clearway.perception import encoder_from_record
from clearway.perception.encoder import NetworkEncoder
from clearway.scenes.actions import ACTION_NAMES
from clearway.scenes.scene import EncoderRecord, Scene


@dataclass(frozen=True)
class SceneAgent:
    """A trained agent in one of its scenes.

    Attributes:
        agent: the agent.
        scene: the scene.
        index: of the scene among the run's.
        scene_names: of all the run's scenes.
    """

    agent: Agent
    scene: Scene
    index: int
    scene_names: tuple[str, ...]

    @property
    def encoder_record(self) -> EncoderRecord:
        """What made the scene's features."""
        assert self.scene.encoder is not None, "a run's scene has features and their record"
        return self.scene.encoder

    def card(self, encoder: NetworkEncoder | None) -> Card:
        """The agent's card; with or without its encoder inside."""
        record, made_by, shape = self.agent.record, self.encoder_record, self.agent.network.shape
        pictures = self.scene.observations
        return Card(
            scene=self.scene.name,
            actions=ACTION_NAMES,
            history_length=shape.history_length,
            feature_count=self.agent.feature_map.feature_count,
            takes_pictures=encoder is not None,
            encoder={"name": made_by.name, "identity": made_by.identity, "settings": dict(made_by.settings)},
            normalisation=self._normalisation(encoder),
            picture_size=None if pictures is None else (pictures.shape[1], pictures.shape[2]),
            training={"seed": record.seed, "reward": asdict(record.reward), "versions": dict(record.versions)},
        )

    def _normalisation(self, encoder: NetworkEncoder | None) -> dict[str, object]:
        """What the agent itself does to what it is given."""
        learner = self.agent.record.learner
        assert isinstance(learner, OnFeatures), "a network's agent has the settings of one"
        pixels = encoder and {"resize": "bilinear, antialiased, the whole picture", **encoder.preprocessing.to_json()}
        return {
            "pixels": pixels,
            "features": {
                "standardised": encoder is not None and encoder.mean is not None,
                "centred": learner.centre_features,
                "whitened": learner.whiten_features,
                "directions": self.agent.feature_map.input_count,
            },
        }


def load_scene_agent(
    folder: Path, scene: str | None = None, *, checkpoint: Path | None = None, files: Sequence[Path] | None = None
) -> SceneAgent:
    """The agent of a run in one of its scenes.

    Args:
        folder: of the run.
        scene: name of the scene; None for the first.
        checkpoint: None for the newest.
        files: scene files, where they are no longer where they were at training.

    Raises:
        RunError: there is no such run or checkpoint, it is damaged, or a scene file is missing or another.
        DeployError: the run has no such scene.
    """
    agent = load_agent(folder, checkpoint)
    names = tuple(kept.name for kept in agent.record.scenes)
    if scene is not None and scene not in names:
        raise DeployError(f"{folder}: was not trained on a scene {scene}. Name one of {', '.join(names)}")
    index = 0 if scene is None else names.index(scene)
    return SceneAgent(agent, run_scenes(agent.record, files)[index], index, names)


def loaded_encoder(chosen: SceneAgent) -> NetworkEncoder:
    """The encoder that made the features of an agent's scene; see `encoder_from_record` for its errors."""
    encoder = encoder_from_record(chosen.encoder_record)
    assert isinstance(encoder, NetworkEncoder)
    return encoder


class RunModel:
    """An agent of a run folder on PyTorch, see `AgentModel`. Features are those that the project's own encoder makes.

    Args:
        chosen: the agent and its scene.

    Raises:
        EncoderError: the encoder that made the scene's features cannot be had.
    """

    def __init__(self, chosen: SceneAgent) -> None:
        self._encoder = loaded_encoder(chosen)
        self._policy = PolicyGraph(chosen.agent, chosen.index)
        self.card: Card = chosen.card(self._encoder)

    def step(self, seen: np.ndarray, start: np.ndarray, history: np.ndarray, target: np.ndarray) -> Step:
        """One step of B agents, see `AgentModel.step`."""
        after = shifted(history, self._encoder.encode(seen), start)
        with torch.inference_mode():
            probabilities, value = self._policy(torch.from_numpy(after), torch.from_numpy(target))
        return Step(probabilities.numpy(), value.numpy(), after)
