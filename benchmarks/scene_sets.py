"""The scenes that benchmarks train on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch

from clearway.errors import SceneError
from clearway.learn.presets import DEFAULT
from clearway.model.feature_map import fitted_features
from clearway.perception import encode_scenes
from clearway.rooms import ROOM_NAMES
from clearway.rooms.library import cached_room_scene
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets
from clearway.scenes.thor_v1 import read_scene
from clearway.world.world import World, make_world

ENCODER = "random-resnet50"
ON_PREPARED = replace(DEFAULT, centre_features=False, whiten_features=False)  # the default learner on `prepared` scenes


def chosen_scenes(files: Sequence[Path]) -> list[Scene]:
    """The scenes in the files; where there are none, the four default rooms, built and encoded once."""
    if files:
        scenes = [read_scene(path) for path in files]
        for scene in scenes:
            if scene.features is None:
                raise SceneError(
                    scene.name, "the scene has no features", "Encode it first, with clearway scenes import"
                )
        return scenes
    return encode_scenes([cached_room_scene(name, progress=True) for name in ROOM_NAMES], ENCODER, progress=True)


def prepared(scenes: Sequence[Scene]) -> list[Scene]:
    """The scenes with features as the default learner's network wants them, and nothing that only takes memory."""
    features = [torch.from_numpy(scene.features) for scene in scenes]
    feature_map = fitted_features(torch.cat(features), DEFAULT)
    return [
        replace(scene, features=feature_map(own).numpy(), observations=None, top_view=None)
        for scene, own in zip(scenes, features, strict=True)
    ]


def world_of(scenes: Sequence[Scene]) -> World:
    """The scenes with their default targets."""
    return make_world(scenes, {scene.name: default_targets(scene) for scene in scenes})
