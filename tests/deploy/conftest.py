"""A run of an instant on two scenes with a tiny encoder, and what `clearway export` makes of it.

The translation to ONNX takes seconds, however small the network: one file with the encoder and one without, for all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from clearway.deploy.export import export_onnx
from clearway.deploy.from_run import RunInScene, load_run_in_scene
from clearway.learn.train import train
from clearway.perception import encoder_from_record
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import ResNetShape, fit_record
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import grid_scene
from helpers.one_file import OneFile
from helpers.small_runs import small_learner, small_request

TINY = ResNetShape(8, (16,), (1,), "basic")
TARGETS = {"attic": (5, 22), "cellar": (3, 9)}


def encoded_scenes() -> list[Scene]:
    """Two small rooms with pictures, and features by a tiny random ResNet that sees 16 x 20 pixels."""
    scenes = [grid_scene(seed, width=4, depth=3, name=name) for seed, name in enumerate(TARGETS)]
    pictures = [scene.observations for scene in scenes]
    record = fit_record(pictures, shape=TINY, preprocessing=Preprocessing(16, 20), sample_pictures=32)
    encoder = encoder_from_record(record)
    return [scene.with_features(encoder.encode(scene.observations), record) for scene in scenes]


@dataclass(frozen=True)
class Deployed:
    """A run folder with its scenes, and the file exported from it for the scene "cellar"."""

    run: Path
    scenes: list[Scene]
    chosen: RunInScene
    agent: Path

    @property
    def pictures(self) -> np.ndarray:
        """(S, height, width, 3) of the scene "cellar"."""
        return self.scenes[1].observations[:]


@pytest.fixture(scope="session")
def deployed(tmp_path_factory: pytest.TempPathFactory) -> Deployed:
    folder = tmp_path_factory.mktemp("deployed")
    paths = {name: folder / f"{name}.h5" for name in TARGETS}
    for scene in encoded_scenes():
        write_scene(scene, paths[scene.name])
    scenes = [read_scene(path) for path in paths.values()]
    learner = replace(small_learner(frames=1600), whiten_features=True, centre_features=True, feature_basis=12)
    train(small_request(scenes=scenes, paths=paths, targets=TARGETS, learner=learner), folder / "run")
    chosen = load_run_in_scene(folder / "run", "cellar")
    export_onnx(chosen, folder / "agent.onnx")
    return Deployed(folder / "run", scenes, chosen, folder / "agent.onnx")


@pytest.fixture(scope="session")
def policy_file(deployed: Deployed) -> Path:
    """The policy alone."""
    path = deployed.agent.with_name("policy.onnx")
    export_onnx(deployed.chosen, path, with_encoder=False)
    return path


@pytest.fixture(scope="session")
def one_file(tmp_path_factory: pytest.TempPathFactory) -> OneFile:
    """The generalist with small eyes, and its file."""
    return OneFile(tmp_path_factory.mktemp("generalist"))
