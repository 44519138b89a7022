"""Checkpoints: safetensors with a JSON manifest of SHA-256 sums, written whole or not at all. Never pickle.

A checkpoint is a folder:

    network.safetensors    parameters, and the map that prepares features
    training.safetensors   everything else that training needs to go on bit for bit
    checkpoint.json        format version, frames, updates, seconds, SHA-256 of both files

It is written under a temporary name and renamed, so a folder of the right name is complete.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from safetensors import SafetensorError
from safetensors.torch import load, save, save_file
from torch import Tensor

from clearway.errors import RunError, reason_of
from clearway.files import read_json
from clearway.regular_files import read_bytes, sha256_of

FORMAT_VERSION = 1
NETWORK_FILE, TRAINING_FILE, MANIFEST_FILE = "network.safetensors", "training.safetensors", "checkpoint.json"
MAX_BYTES = 8 * 1024**3  # of a file
KEPT = 2  # newest checkpoints that stay
_NAME = re.compile(r"frames-(\d{12})")


class _Damaged(RunError):
    """A checkpoint's files are not as they were written."""


@dataclass(frozen=True)
class Progress:
    """How far training had come."""

    frames: int
    updates: int
    seconds: float


def write_checkpoint(
    folder: Path, network: Mapping[str, Tensor], training: Mapping[str, Tensor], progress: Progress
) -> Path:
    """Write a checkpoint into `folder` and remove those before it but the newest few; returns its path.

    Raises:
        RunError: the disk is full or the folder cannot be written; earlier checkpoints stay as they are.
    """
    final = folder / f"frames-{progress.frames:012d}"
    part = folder / f".{final.name}.part"
    try:
        for half_written in folder.glob(".frames-*.part"):  # by a process that was killed
            shutil.rmtree(half_written)
        part.mkdir(parents=True)
        sums = {}
        for name, tensors in ((NETWORK_FILE, network), (TRAINING_FILE, training)):
            save_file(_as_written(tensors), part / name)
            sums[name] = sha256_of(part / name)
        manifest = {"format_version": FORMAT_VERSION, **vars(progress), "sha256": sums}
        (part / MANIFEST_FILE).write_text(json.dumps(manifest, indent=2) + "\n")
        _to_disk(part)
        shutil.rmtree(final, ignore_errors=True)
        part.rename(final)
        _to_disk(folder)
    except (OSError, SafetensorError) as error:
        shutil.rmtree(part, ignore_errors=True)
        raise RunError(f"{final}: cannot write the checkpoint ({error}). Free some space, then resume") from error
    upto_now = [path for path in checkpoints(folder) if path.name <= final.name]  # later ones are damaged
    for old in upto_now[:-KEPT]:
        shutil.rmtree(old)
    return final


def written_and_read(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors as a checkpoint would give them back; no file is made.

    Raises:
        Exception: whatever PyTorch and safetensors raise of what cannot be kept.
    """
    return load(save(_as_written(tensors)))


def _as_written(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}


def keep_newest_checkpoint(folder: Path) -> None:
    """Remove all checkpoints in `folder` but the newest. Raises RunError as `newest_checkpoint` does; then all stay."""
    newest = newest_checkpoint(folder)
    for path in checkpoints(folder):
        if path != newest:
            shutil.rmtree(path)


def newest_checkpoint(folder: Path) -> Path:
    """The newest checkpoint in `folder` whose files are as they were written; damaged ones are passed over.

    Warns:
        UserWarning: a newer checkpoint is damaged.

    Raises:
        RunError: there is none, all are damaged, or the newest was written by a newer clearway.
    """
    for path in reversed(checkpoints(folder)):
        try:
            read_progress(path)
            return path
        except _Damaged as error:
            warnings.warn(f"{error}; an earlier checkpoint is used", stacklevel=2)
    if checkpoints(folder):
        raise RunError(f"{folder}: every checkpoint is damaged. Restore one from a copy, or train again")
    raise RunError(f"{folder}: no checkpoint found. Train first, or name another run (records of runs hold no weights)")


def read_progress(path: Path) -> Progress:
    """How far training had come when the checkpoint was written."""
    manifest = _checked_manifest(path)
    try:
        return Progress(int(manifest["frames"]), int(manifest["updates"]), float(manifest["seconds"]))
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        raise _Damaged(f"{path / MANIFEST_FILE}: lacks a number ({error}). Use another checkpoint") from error


def read_network(path: Path) -> dict[str, Tensor]:
    """The tensors of `network.safetensors`, checked against the manifest."""
    return _read_tensors(path, NETWORK_FILE)


def read_training(path: Path) -> dict[str, Tensor]:
    """The tensors of `training.safetensors`, checked against the manifest."""
    return _read_tensors(path, TRAINING_FILE)


def _read_tensors(path: Path, name: str) -> dict[str, Tensor]:
    manifest = _checked_manifest(path)
    try:
        content = read_bytes(path / name, MAX_BYTES)
        if hashlib.sha256(content).hexdigest() != manifest["sha256"][name]:
            raise _Damaged(f"{path / name}: has changed while it was read. Use another checkpoint")
        return load(content)
    except (OSError, SafetensorError) as error:
        raise _Damaged(f"{path / name}: cannot be read ({reason_of(error)}). Use another checkpoint") from error


def checkpoints(folder: Path) -> list[Path]:
    """Checkpoints in `folder`, oldest first."""
    return sorted(path for path in folder.glob("frames-*") if is_name(path.name))


def is_name(name: str) -> bool:
    """Whether a folder's name is that of a checkpoint."""
    return _NAME.fullmatch(name) is not None


def frames_in(name: str) -> int:
    """How far training had come by the name of a checkpoint's folder, see `is_name`."""
    return int(name.removeprefix("frames-"))


def _checked_manifest(path: Path) -> dict:
    try:
        manifest = read_json(path / MANIFEST_FILE)
        version = int(manifest["format_version"])
        if version > FORMAT_VERSION:  # it may hold other files, so this comes before looking for ours
            raise RunError(f"{path}: written by a newer clearway (format {version}). Upgrade clearway")
        sums = dict(manifest["sha256"])
        actual = {name: sha256_of(path / name) for name in (NETWORK_FILE, TRAINING_FILE)}
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise _Damaged(f"{path}: the checkpoint is incomplete ({error}). Use another one") from error
    for name, digest in actual.items():
        if sums.get(name) != digest:
            raise _Damaged(f"{path / name}: its SHA-256 differs from the manifest's. Use another checkpoint")
    return manifest


def _to_disk(folder: Path) -> None:
    """Flush the folder's files and the folder itself."""
    for path in [*folder.iterdir(), folder]:
        if path.is_file() or path == folder:
            handle = os.open(path, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)
