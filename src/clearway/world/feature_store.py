"""Where the features of a world's states are kept: in memory, in half of it, or in a file mapped into memory.

    memory     float32
    float16    float32 rounded to 11 bits; computed with in float32
    mapped     float32 in a file in the cache folder; the system keeps in memory what is used, as far as there is room.
               Where scenes come in one file (`mapped_scenes`), all processes share that, and none may write to it;
               else it is one of the process's own, without a name. Neither outlives the training

Each is a tensor (S, F), and `features[states].float()` gives features whatever the store.

Axis letters: S states, F features.
"""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import IO

import numpy as np
import torch
from torch import Tensor

from clearway.choices import FeatureStore
from clearway.errors import RunError, SceneError
from clearway.files import CACHE_VARIABLE, cache_dir
from clearway.scenes.mapped_features import FLOAT_BYTES, MappedFeatures
from clearway.scenes.records import FILE_ENCODER
from clearway.scenes.scene import Features, Scene

CPU = torch.device("cpu")
FEW_STATES = 16_384  # up to so many, whatever is computed of states is computed of all of them at once
BLOCK_ROWS = 2_048  # features that go through memory at a time: of few numbers they stay in the processor's cache
LARGEST_FLOAT16 = 65_504.0


def joined_features(scenes: Sequence[Scene], store: FeatureStore) -> Tensor | None:
    """The scenes' features one after the other, (S, F), or None where they have none.

    Raises:
        SceneError: only some have features, or they do not belong together or fit the store.
        RunError: there is no room for them.
    """
    if all(scene.features is None for scene in scenes):
        return None
    check_together(scenes)
    features = [scene.features for scene in scenes]
    assert features[0] is not None
    if store == "mapped" and (whole := _adjoining(features)):
        return _shared(whole)
    size = sum(scene.state_count for scene in scenes), features[0].shape[1]
    if store == "mapped":
        return mapped_store((np.asarray(scene.features, np.float32) for scene in scenes), *size)
    joined = empty_store(*size, store)
    for scene, rows in zip(scenes, joined.split([scene.state_count for scene in scenes]), strict=True):
        own = np.asarray(scene.features, np.float32)
        if store == "float16" and np.abs(own).max() > LARGEST_FLOAT16:
            problem = f"holds features beyond {LARGEST_FLOAT16:,.0f}, the largest of float16"
            raise SceneError(scene.name, problem, "Keep features in another store, mapped", "resnet_feature")
        rows.numpy()[:] = own
    return joined


def check_together(scenes: Sequence[Scene]) -> None:
    """Raise SceneError where only some scenes have features, or features of other encoders."""
    first = scenes[0]
    for scene in scenes:
        if scene.features is None or first.features is None:
            raise SceneError(scene.name, "only some of the scenes have features", _remedy(first))
        if scene.features.shape[1] != first.features.shape[1]:
            sizes = f"{scene.features.shape[1]} features a state, {first.name} has {first.features.shape[1]}"
            raise SceneError(scene.name, sizes, _remedy(first), "resnet_feature")
        if _identity(scene) != _identity(first):
            problem = f"features made by {_identity(scene)}, those of {first.name} by {_identity(first)}"
            raise SceneError(scene.name, problem, _remedy(first), "resnet_feature")


def _adjoining(features: Sequence[Features | None]) -> MappedFeatures | None:
    """All rows of features that lie one after the other in one file; None where they do not."""
    first, rows = features[0], 0
    for own in features:
        if not isinstance(own, MappedFeatures) or not isinstance(first, MappedFeatures):
            return None
        if (own.path, own.first) != (first.path, first.first + rows):
            return None
        rows += own.shape[0]
    assert isinstance(first, MappedFeatures)
    return replace(first, shape=(rows, first.shape[1]))


def _identity(scene: Scene) -> str:
    return f"{scene.encoder.name} ({scene.encoder.identity})" if scene.encoder else "an unknown encoder"


def _remedy(scene: Scene) -> str:
    """The command that gives scenes features of one encoder: this scene's, or the default where that cannot be had."""
    named = scene.encoder is not None and not scene.encoder.name.startswith(FILE_ENCODER)
    name = scene.encoder.name if scene.encoder and named else "clearway"
    return f"Encode all of them together: clearway scenes encode FILES --encoder {name} --out FOLDER"


def empty_store(states: int, features: int, store: FeatureStore, device: torch.device | str = "cpu") -> Tensor:
    """Room in memory for features (S, F), not set yet.

    Raises:
        RunError: there is not so much memory.
    """
    with room_for(states, features, store, torch.device(device)):
        dtype = torch.float16 if store == "float16" else torch.float32
        return torch.empty(states, features, dtype=dtype, device=device)


def mapped_store(blocks: Iterable[np.ndarray], states: int, features: int) -> Tensor:
    """Blocks of rows of features, each (B, F), one after the other in a file that is mapped, (S, F) float32.

    They are written, which costs less than setting pages that are mapped.

    Raises:
        RunError: there is no room in the cache folder.
    """
    room = partial(room_for, states, features, "mapped")
    with room():
        folder = cache_dir()
        folder.mkdir(parents=True, exist_ok=True)
        file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - closed below
    with file:
        with room():
            reserve(file, states * features * FLOAT_BYTES)
        for block in blocks:
            content = np.ascontiguousarray(block, np.float32).data
            with room():
                file.write(content)
        with room():
            return torch.from_numpy(np.memmap(file, np.float32, "r+", shape=(states, features)))


@contextmanager
def room_for(states: int, features: int, store: FeatureStore, device: torch.device = CPU) -> Iterator[None]:
    """Turn what goes wrong where memory, of this machine or a GPU, or a file is asked for into RunError."""
    try:
        yield
    except (OSError, RuntimeError, MemoryError) as fault:
        size = f"{features} features of {states} states need {_gib(states, features, store):.1f} GiB"
        if device.type != "cpu":
            raise RunError(
                f"{size} on {device}, which cannot be had ({fault}). Give fewer scenes, or --device cpu"
            ) from fault
        if store == "mapped":
            remedy = f"Make room, or set {CACHE_VARIABLE} to a folder on another disk"
            raise RunError(f"{cache_dir()}: {size}, which cannot be had ({fault}). {remedy}") from fault
        raise RunError(f"{size} of memory, which cannot be had. Give --feature-store mapped") from fault


def _shared(features: MappedFeatures) -> Tensor:
    """Features (S, F) where they lie; who writes to them ends the process.

    Raises:
        RunError: they cannot be mapped.
    """
    states, count = features.shape
    with room_for(states, count, "mapped"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The given NumPy array is not writable", UserWarning)
        return torch.from_numpy(np.asarray(features))


def reserve(file: IO[bytes], size: int) -> None:
    """Make a new file so large, in bytes. Raises OSError where there is no room."""
    if hasattr(os, "posix_fallocate"):  # a disk that is full later would end the process without a word
        os.posix_fallocate(file.fileno(), 0, size)
    else:
        file.truncate(size)


def _gib(states: int, features: int, store: FeatureStore) -> float:
    return states * features * (2 if store == "float16" else FLOAT_BYTES) / 1024**3
