"""ONNX files of agents: read with onnxruntime alone, and refused once a byte has changed.

The metadata entry `clearway.sha256` holds the SHA-256 of the whole file, computed with zeros in its own place. It is
found by its bytes, so that no parser sees a file before it was checked.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from clearway.deploy.card import EXPORT_AGAIN, Card, card_from_json
from clearway.deploy.model import ModelOutput
from clearway.errors import DeployError

CARD_KEY, CHECKSUM_KEY = "clearway", "clearway.sha256"
MAX_BYTES = 1 << 31  # of one ONNX file, by its format
NO_DIGEST = b"0" * 64
_MARK = CHECKSUM_KEY.encode() + b"\x12\x40"  # the entry's key, then the header of a text of 64 bytes


def sealed(content: bytes) -> bytes:
    """An ONNX file whose checksum entry holds zeros, with the checksum in it."""
    place = content.index(_MARK + NO_DIGEST) + len(_MARK)
    digest = hashlib.sha256(content).hexdigest().encode()
    return content[:place] + digest + content[place + len(digest) :]


def check_seal(content: bytes, source: str) -> None:
    """Raise DeployError where an ONNX file is not as `sealed` left it."""
    place = content.find(_MARK) + len(_MARK)
    if place < len(_MARK):
        raise DeployError(f"{source}: not an agent's ONNX file, or cut off (no checksum in it). {EXPORT_AGAIN}")
    kept = content[place : place + len(NO_DIGEST)]
    digest = hashlib.sha256(content[:place])
    digest.update(NO_DIGEST)
    digest.update(memoryview(content)[place + len(NO_DIGEST) :])
    if digest.hexdigest().encode() != kept:
        raise DeployError(f"{source}: has changed since it was exported (its SHA-256 differs). {EXPORT_AGAIN}")


class OnnxModel:
    """An exported agent on onnxruntime, see `AgentModel`.

    Args:
        path: the file.
        threads: processor threads; None: one a core.

    Raises:
        DeployError: there is no such file, it is no exported agent or was changed, or onnxruntime is not installed.
    """

    def __init__(self, path: Path, threads: int | None = None) -> None:
        content = _content(path)
        check_seal(content, str(path))
        self._session = _session(content, path, threads)
        metadata = self._session.get_modelmeta().custom_metadata_map
        self.card: Card = card_from_json(metadata.get(CARD_KEY, ""), str(path))

    def step(self, seen: np.ndarray, start: np.ndarray, history: np.ndarray, target: np.ndarray) -> ModelOutput:
        """One step of B agents, see `AgentModel.step`."""
        if self.card.takes_pictures:
            given = {"picture": seen, "start": start, "history": history, "target": target}
            return ModelOutput(*self._session.run(["probabilities", "value", "history_after"], given))
        after = shifted(history, seen, start)
        probabilities, value = self._session.run(["probabilities", "value"], {"history": after, "target": target})
        return ModelOutput(probabilities, value, after)


def shifted(history: np.ndarray, features: np.ndarray, start: np.ndarray) -> np.ndarray:
    """The history (B, K, F) after features (B, F) were seen; those that fill it where start (B,) is true."""
    older = np.where(start[:, None, None], features[:, None], history)
    return np.concatenate([older[:, 1:], features[:, None]], axis=1)


def _content(path: Path) -> bytes:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise DeployError(f"{path}: larger than an ONNX file can be. {EXPORT_AGAIN}")
        return path.read_bytes()
    except OSError as fault:
        raise DeployError(f"{path}: cannot be read ({fault.strerror}). Check the path") from fault


def _session(content: bytes, path: Path, threads: int | None) -> Any:
    try:
        import onnxruntime
    except ImportError as fault:
        raise DeployError(f"{path}: needs onnxruntime. Install it: pip install 'clearway[onnx]'") from fault
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads or 0
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")  # idle threads leave the processor
    try:
        return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as fault:  # onnxruntime's own errors share no other base
        reason = " ".join(str(fault).split())[:300]
        raise DeployError(
            f"{path}: onnxruntime {onnxruntime.__version__} cannot run it ({reason}). Upgrade it"
        ) from fault
