"""Files of `RoomMap`: a safetensors file whose header is JSON: which eyes made it, how long a move is, its SHA-256.

The hash guards against damage, not against forgers; shapes and values are checked besides.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clearway.errors import DeployError
from clearway.files import parse_json, safetensors_metadata, written_whole
from clearway.mapping.lattice import HEADINGS
from clearway.mapping.room_map import RoomMap
from clearway.regular_files import read_bytes

FORMAT_VERSION = 2
HEADER = "clearway.map"
MAX_BYTES, MAX_SIDE, MAX_PICTURES = 256 * 1024**2, 1025, 10_000
DTYPES: Mapping[str, type[np.generic]] = {
    "room": np.float32,
    "shut": np.bool_,
    "taken": np.int64,
    "features": np.float16,
}
AGAIN = "Tour the room again"


def write_map(path: Path, known: RoomMap, eyes: str, step_m: float) -> None:
    """Write a map, with the identity of the eyes that made it and the length of a move. Raises OSError."""
    from safetensors.numpy import save

    arrays: dict[str, np.ndarray] = {
        name: np.ascontiguousarray(getattr(known, name), dtype) for name, dtype in DTYPES.items()
    }
    header = {"format_version": FORMAT_VERSION, "eyes": eyes, "step_m": step_m, "sha256": _sha256(arrays)}
    with written_whole(path) as part:
        part.write_bytes(save(arrays, {HEADER: json.dumps(header)}))


def read_map(path: Path, eyes: str, step_m: float, feature_count: int) -> RoomMap:
    """The map in a file.

    Args:
        path: the file.
        eyes: identity of those that are to go by it.
        step_m: length of their moves.
        feature_count: F, of theirs.

    Raises:
        DeployError: it cannot be read, is no map, was altered, or was made by other eyes or moves.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        content = read_bytes(path, MAX_BYTES)
    except OSError as fault:
        raise DeployError(f"{path}: cannot be read ({fault.strerror}). Check the path") from fault
    try:
        header = parse_json(safetensors_metadata(content)[HEADER])
        version, made_by, sha256 = header["format_version"], header["eyes"], header["sha256"]
        arrays = load(content)
    except (SafetensorError, ValueError, KeyError, TypeError) as fault:
        reason = " ".join(str(fault).split())[:120]
        raise DeployError(f"{path}: not the map of a room, or damaged ({reason}). {AGAIN}") from fault
    problem: str | None
    if version != FORMAT_VERSION:
        raise DeployError(f"{path}: of format {version!r:.20}, this clearway reads {FORMAT_VERSION}. {AGAIN}")
    if made_by != eyes:
        problem = f"{path}: made by other eyes ({made_by!r:.40}), and the agent's are {eyes!r:.40}"
        raise DeployError(f"{problem}. {AGAIN}, or open the agent that made it")
    if (made_at := header.get("step_m")) != step_m:
        problem = f"{path}: made by moves of {made_at!r:.20} m, and the agent's are {step_m:g} m"
        raise DeployError(f"{problem}. {AGAIN}, or open the agent that made it")
    if problem := _problem(arrays, feature_count):
        raise DeployError(f"{path}: {problem}. {AGAIN}")
    if _sha256(arrays) != sha256:
        raise DeployError(f"{path}: altered, its SHA-256 is not what its header says. {AGAIN}")
    return RoomMap(**arrays)


def _problem(arrays: Mapping[str, np.ndarray], feature_count: int) -> str | None:
    """What keeps arrays from being a map."""
    if arrays.keys() != DTYPES.keys():
        return f"holds {', '.join(sorted(arrays))}, expected {', '.join(DTYPES)}"
    side, count = len(arrays["room"]) if arrays["room"].ndim else 0, len(arrays["taken"]) if arrays["taken"].ndim else 0
    shapes = {
        "room": (side, side),
        "shut": (HEADINGS, side, side),
        "taken": (count, 3),
        "features": (count, feature_count),
    }
    for name, shape in shapes.items():
        found = arrays[name]
        if found.shape != shape or found.dtype != DTYPES[name]:
            return f"{name} is {found.dtype} {found.shape}, expected {np.dtype(DTYPES[name])} {shape}"
    if not 1 <= side <= MAX_SIDE or not 1 <= count <= MAX_PICTURES:
        return f"has {count} pictures on {side} x {side} cells, at most {MAX_PICTURES} on {MAX_SIDE} x {MAX_SIDE}"
    if (arrays["taken"] < 0).any() or (arrays["taken"] >= (HEADINGS, side, side)).any():
        return "a picture's pose lies outside it"
    if not all(np.isfinite(arrays[name]).all() for name in ("room", "features")):
        return "holds NaN or Inf"
    return None


def _sha256(arrays: Mapping[str, np.ndarray]) -> str:
    """Of the arrays, in their order."""
    digest = hashlib.sha256()
    for name in DTYPES:
        digest.update(f"{name} {arrays[name].dtype} {arrays[name].shape}\n".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()
