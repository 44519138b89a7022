"""An agent for one scene out of a run folder: its card, and `RunAgent`, which computes it with PyTorch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from clearway.agents.arrival import Arrival, fitted_arrival
from clearway.deploy.card import ARRIVAL, Card
from clearway.errors import DeployError, EncoderError
from clearway.learn.foreign_agent import faults_of_agent
from clearway.learn.learner import OnFeatures
from clearway.learn.load import TrainedNetwork, load_network, run_scenes
from clearway.learn.network_agent import NetworkAgent, policy_in
from clearway.model.policy import ScenePolicy
from clearway.perception import Encoder, encoder_from_record, eyes
from clearway.perception.encoder import NetworkEncoder, sensor_of
from clearway.scenes.actions import ACTION_NAMES
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.scenes.sensors import RGB


@dataclass(frozen=True)
class RunInScene:
    """A trained agent in one of its scenes.

    Attributes:
        trained: what its run has learnt.
        scene: the scene.
        index: of the scene among the run's.
        scene_names: of all the run's scenes.
    """

    trained: TrainedNetwork
    scene: Scene
    index: int
    scene_names: tuple[str, ...]

    @property
    def encoder_record(self) -> EncoderRecord:
        """What made the scene's features."""
        assert self.scene.encoder is not None, "a run's scene has features and their record"
        return self.scene.encoder

    @property
    def policy(self) -> ScenePolicy:
        """What decides in the scene, by features. Raises PluginError: another package's agent gives none."""
        return policy_in(self.trained, self.index)

    @cached_property
    def arrival(self) -> Arrival | None:
        """Says where it has arrived, by the scene's own pictures; None where they are all the same."""
        assert self.scene.features is not None, "a run's scene has features"
        features = np.asarray(self.scene.features)
        return fitted_arrival(features, compared_numbers(self.encoder_record, features.shape[1]))

    def card(self, encoder: Encoder | None) -> Card:
        """The agent's card; with or without its encoder inside. Raises PluginError as `policy` does."""
        record, made_by = self.trained.record, self.encoder_record
        with faults_of_agent(self.trained, "what it tells of its network"):
            history_length = self.trained.network.shape.history_length
            feature_count = self.trained.feature_map.feature_count
            normalisation = self._normalisation(encoder)
        pictures = self.scene.observations
        seen = next((one for one in self.scene.sensors if one.name == sensor_of(made_by)), None)
        return Card(
            scene=self.scene.name,
            actions=ACTION_NAMES,
            history_length=history_length,
            feature_count=feature_count,
            takes_pictures=encoder is not None,
            encoder={"name": made_by.name, "identity": made_by.identity, "settings": dict(made_by.settings)},
            normalisation=normalisation,
            picture_size=None if pictures is None else (pictures.shape[1], pictures.shape[2]),
            training={
                "seed": record.seed,
                "reward": record.reward.to_json(),
                "targets": list(record.targets[self.scene.name]),
                "versions": dict(record.versions),
            },
            observation=None if seen is None else seen.to_json(),
            settings={} if self.arrival is None else {ARRIVAL: self.arrival.to_json()},
        )

    def _normalisation(self, encoder: Encoder | None) -> dict[str, object]:
        """What the agent itself does to what it is given."""
        learner = self.trained.record.learner
        assert isinstance(learner, OnFeatures), "a network's agent has the settings of one"
        network = encoder if isinstance(encoder, NetworkEncoder) else None  # another package's says nothing of itself
        pixels = network and {"resize": "bilinear, antialiased, the whole picture", **network.preprocessing.to_json()}
        return {
            "pixels": pixels,
            "features": {
                "standardised": network is not None and network.mean is not None,
                "centred": learner.centre_features,
                "whitened": learner.whiten_features,
                "directions": self.trained.feature_map.input_count,
            },
        }


def compared_numbers(record: EncoderRecord, feature_count: int) -> int:
    """How many features tell two pictures apart, from the first: the description that eyes make, else all."""
    if record.settings.get("kind") != eyes.KIND:
        return feature_count
    shape: Any = record.settings["shape"]
    return int(shape["description_width"])


def load_run_in_scene(
    folder: Path, scene: str | None = None, *, checkpoint: Path | None = None, files: Sequence[Path] | None = None
) -> RunInScene:
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
    trained = load_network(folder, checkpoint)
    names = tuple(kept.name for kept in trained.record.scenes)
    if scene is not None and scene not in names:
        raise DeployError(f"{folder}: was not trained on a scene {scene}. Name one of {', '.join(names)}")
    index = 0 if scene is None else names.index(scene)
    return RunInScene(trained, run_scenes(trained.record, files)[index], index, names)


def picture_encoder(chosen: RunInScene) -> Encoder:
    """The encoder that made the features of an agent's scene.

    Raises:
        EncoderError: as of `encoder_from_record`, or it takes no colour pictures.
    """
    seen = sensor_of(chosen.encoder_record)
    if seen != RGB:
        problem = f"encoder {chosen.encoder_record.name} sees {seen}, and deployed agents take colour pictures"
        raise EncoderError(f"{problem}. Train on features of another encoder")
    return encoder_from_record(chosen.encoder_record)


def exportable_encoder(chosen: RunInScene) -> NetworkEncoder:
    """The encoder that made the features of an agent's scene, as a network.

    Raises:
        EncoderError: as of `picture_encoder`, or it is one of another package, which may be no network.
    """
    encoder = picture_encoder(chosen)
    if not isinstance(encoder, NetworkEncoder):
        problem = f"encoder {encoder.record.name}: is another package's, which a file cannot hold"
        raise EncoderError(f"{problem}. Use the run folder itself")
    return encoder


class RunAgent(NetworkAgent):
    """The agent of a run folder on PyTorch. Features are those that the project's own encoder makes.

    Args:
        chosen: the agent and its scene.

    Raises:
        EncoderError: the encoder that made the scene's features cannot be had.
        PluginError: another package's network fails, then or walking.
    """

    def __init__(self, chosen: RunInScene) -> None:
        encoder = picture_encoder(chosen)
        super().__init__(chosen.trained, chosen.index, encoder, chosen.arrival)
        self.card: Card = chosen.card(encoder)
