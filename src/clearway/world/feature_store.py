"""Where the features of a world's states are kept: in memory, in half of it, or in a file mapped into memory.

    memory     float32
    float16    float32 rounded to 11 bits; computed with in float32
    mapped     float32 in a file without a name in the cache folder, which is gone with the process; the system keeps in
               memory what is used, as far as there is room

Each is a tensor (S, F), and `features[states].float()` gives features whatever the store.

Axis letters: S states, F features.
"""

from __future__ import annotations

import os
import tempfile

import numpy as np
import torch
from torch import Tensor

from clearway.choices import FeatureStore
from clearway.errors import RunError
from clearway.files import CACHE_VARIABLE, cache_dir

FEW_STATES = 16_384  # up to so many, whatever is computed of states is computed of all of them at once
BLOCK_ROWS = 8_192  # features that go through memory at a time
LARGEST_FLOAT16 = 65_504.0


def empty_store(states: int, features: int, store: FeatureStore) -> Tensor:
    """Room for features (S, F), not set yet.

    Raises:
        RunError: there is not so much memory, or room in the cache folder.
    """
    try:
        if store == "mapped":
            return _mapped(states, features)
        return torch.empty(states, features, dtype=torch.float16 if store == "float16" else torch.float32)
    except (OSError, RuntimeError, MemoryError) as fault:
        size = f"{features} features of {states} states need {_gib(states, features, store):.1f} GiB"
        if store == "mapped":
            remedy = f"Make room, or set {CACHE_VARIABLE} to a folder on another disk"
            raise RunError(f"{cache_dir()}: {size}, which cannot be had ({fault}). {remedy}") from fault
        raise RunError(f"{size} of memory, which cannot be had. Give --feature-store mapped") from fault


def _mapped(states: int, features: int) -> Tensor:
    folder = cache_dir()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as file:
        size = states * features * 4
        if hasattr(os, "posix_fallocate"):  # a disk that is full later would end the process without a word
            os.posix_fallocate(file.fileno(), 0, size)
        else:
            file.truncate(size)
        return torch.from_numpy(np.memmap(file, np.float32, "r+", shape=(states, features)))


def _gib(states: int, features: int, store: FeatureStore) -> float:
    return states * features * (2 if store == "float16" else 4) / 1024**3
