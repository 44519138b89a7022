"""Runs exported once: onnxruntime runs the encoder in about half of PyTorch's time, see docs/deploy.md."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import clearway
from clearway import files
from clearway.deploy.export import export_onnx
from clearway.deploy.from_run import RunInScene
from clearway.deploy.onnx_file import OnnxAgent, read_onnx
from clearway.errors import DeployError
from clearway.version import __version__

KEY_LETTERS = 16
PACKAGES = Path(clearway.__file__).parent
SHAPING = ("agents", "deploy", "model", "perception")  # packages whose code shapes the file


def cached_agent(chosen: RunInScene, tell: Callable[[str], object], threads: int | None = None) -> OnnxAgent:
    """A run's agent on onnxruntime, exported to the user's cache folder the first time; a damaged file is made again.

    Args:
        chosen: the agent and its scene.
        tell: called with a line before an export, which takes its time.
        threads: of the processor; None: one a core.

    Raises:
        DeployError, EncoderError: see `export_onnx`.
    """
    path = files.cache_dir() / "agents" / f"{chosen.scene.name}-{_key(chosen)}.onnx"
    with files.locked(path):
        try:
            return OnnxAgent(read_onnx(path, threads))
        except DeployError:
            tell(f"exporting the agent for scene {chosen.scene.name}, once ...")
            export_onnx(chosen, path)
    return OnnxAgent(read_onnx(path, threads))


def _key(chosen: RunInScene) -> str:
    """Hash of all that shapes the file: parameters, scene, encoder, the code of all three and clearway's version."""
    agent, digest = chosen.trained, hashlib.sha256()
    for tensors in (agent.network.state_dict(), agent.feature_map.tensors()):
        for name, tensor in sorted(tensors.items()):
            digest.update(f"{name} {tuple(tensor.shape)}\n".encode())
            digest.update(tensor.detach().contiguous().numpy().tobytes())
    digest.update(f"{chosen.index} {chosen.scene.name} {chosen.encoder_record.identity}\n".encode())
    digest.update(f"{__version__}\n".encode())
    for package in SHAPING:
        for source in sorted((PACKAGES / package).glob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:KEY_LETTERS]
