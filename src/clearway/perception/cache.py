"""Arrays kept by the content they were made from, in the user's cache folder.

An entry is one safetensors file with a checksum. A damaged one counts as absent: what it held is made again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from clearway.errors import EncoderError
from clearway.files import cache_dir, cache_faults_named, locked, parse_json, safetensors_metadata, written_whole
from clearway.regular_files import read_bytes
from clearway.scenes.file_pictures import BLOCK_PICTURES
from clearway.scenes.scene import Observations

MAX_BYTES = 8 * 1024**3  # of an entry


@dataclass(frozen=True)
class Entry:
    """What is kept under one key: arrays by name, and a note of JSON values."""

    arrays: Mapping[str, np.ndarray]
    note: Mapping[str, object] = field(default_factory=dict)


def cached(folder: str, key: str, make: Callable[[], Entry]) -> Entry:
    """The entry `key`, made and stored if it is not there. One process makes it, others wait for it.

    Args:
        folder: of this kind of entry within the cache folder, for example "features".
        key: file name without suffix; must depend on all that `make` depends on.
        make: makes the entry.

    Raises:
        EncoderError: the cache folder cannot be written to.
    """
    path = cache_dir() / folder / f"{key}.safetensors"
    entry = _load(path)
    if entry is not None:
        return entry
    with ExitStack() as stack:
        with cache_faults_named(path.parent, EncoderError):
            stack.enter_context(locked(path))
        entry = _load(path)  # another process may have made it meanwhile
        if entry is None:
            entry = make()
            with cache_faults_named(path.parent, EncoderError):
                _store(path, entry)
    return entry


def content_key(pictures: Observations) -> str:
    """Hash of the pictures of a scene, read block by block."""
    digest = hashlib.sha256(str(tuple(pictures.shape)).encode())
    for start in range(0, pictures.shape[0], BLOCK_PICTURES):
        digest.update(np.ascontiguousarray(pictures[start : start + BLOCK_PICTURES]).data)
    return digest.hexdigest()


def joint_key(*parts: object) -> str:
    """Hash of several JSON values."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _load(path: Path) -> Entry | None:
    """The entry in a file; None where it is missing, damaged or not one of ours."""
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        content = read_bytes(path, MAX_BYTES)
        kept, arrays = safetensors_metadata(content), load(content)
        note = parse_json(kept["note"])
    except (OSError, SafetensorError, KeyError, ValueError, TypeError):
        return None
    return Entry(arrays, note) if kept.get("sha256") == _checksum(arrays, kept["note"]) else None


def _store(path: Path, entry: Entry) -> None:
    from safetensors.numpy import save_file

    arrays = {name: np.ascontiguousarray(values) for name, values in entry.arrays.items()}
    note = json.dumps(dict(entry.note))
    with written_whole(path) as part:
        save_file(arrays, part, metadata={"note": note, "sha256": _checksum(arrays, note)})


def _checksum(arrays: Mapping[str, np.ndarray], note: str) -> str:
    digest = hashlib.sha256(note.encode())
    for name in sorted(arrays):
        digest.update(f"{name} {arrays[name].dtype} {arrays[name].shape}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).data)
    return digest.hexdigest()
