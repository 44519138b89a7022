"""Writes an agent as one ONNX file: the policy alone, or with the encoder before it."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch

from clearway.agents.generalist import Generalist
from clearway.deploy.card import Card
from clearway.deploy.eyes_graph import EyesGraph
from clearway.deploy.from_run import RunInScene, exportable_encoder
from clearway.deploy.generalist import card_of
from clearway.deploy.onnx_file import CARD_KEY, CHECKSUM_KEY, NO_DIGEST, sealed
from clearway.deploy.onnx_graph import AgentGraph
from clearway.errors import DeployError, install_hint
from clearway.files import written_whole
from clearway.learn.foreign_agent import faults_of_agent
from clearway.mapping.settings import MappingSettings
from clearway.perception.eyes import EyesEncoder
from clearway.version import __version__

OPSET = 18
EXAMPLE_SIDES = (48, 64)  # of the pictures that the graph is traced with; it takes any


def export_onnx(
    chosen: RunInScene, path: Path, *, with_encoder: bool = True, on_begin: Callable[[], None] | None = None
) -> None:
    """Write an agent for one scene.

    With the encoder, the graph's inputs are picture (B, height, width, 3) uint8, start (B,) bool, history (B, K, F)
    float32 and target (B, F) float32, its outputs probabilities (B, A), value (B, 1) and history_after (B, K, F); see
    `OnnxAgent`. The policy alone has the inputs history and target and the outputs probabilities and value. `on_begin`
    is called once it is known that nothing is missing, before what takes long.

    Raises:
        DeployError: the packages of the extra `onnx` are not installed.
        EncoderError: the encoder that made the scene's features cannot be had.
        PluginError: the agent is another package's, and fails, or cannot be translated.
    """
    check_can_export()
    encoder = exportable_encoder(chosen) if with_encoder else None
    if on_begin is not None:
        on_begin()
    policy = chosen.policy
    card = chosen.card(encoder)
    history = torch.zeros(2, card.history_length, card.feature_count)
    batch = torch.export.Dim("batch", min=1)
    inputs: dict[str, torch.Tensor] = {"history": history, "target": history[:, 0].clone()}
    axes: dict[str, dict[int, Any]] = {"history": {0: batch}, "target": {0: batch}}
    outputs = ["probabilities", "value"]
    graph: torch.nn.Module = policy
    if encoder is not None:
        height, width = torch.export.Dim("height", min=1), torch.export.Dim("width", min=1)
        picture = torch.zeros(2, *EXAMPLE_SIDES, 3, dtype=torch.uint8)
        inputs = {"picture": picture, "start": torch.zeros(2, dtype=torch.bool), **inputs}
        axes = {"picture": {0: batch, 1: height, 2: width}, "start": {0: batch}, **axes}
        outputs, graph = [*outputs, "history_after"], AgentGraph(policy, encoder)
    with faults_of_agent(chosen.trained, "its network"), torch.no_grad():
        policy.eval()(history, history[:, 0])  # else layers such as BatchNorm1d would learn from it
    _write(path, card, graph, inputs, outputs, axes, faults_of_agent(chosen.trained, "translating its network"))


def export_generalist(encoder: EyesEncoder, settings: MappingSettings, path: Path) -> None:
    """Write the agent that is bound to no room: its eyes are in the file, its settings on the card; see `OnnxEyes`.

    Raises:
        DeployError: the packages of the extra `onnx` are not installed.
    """
    check_can_export()
    card = card_of(replace(Generalist.by_eyes(encoder), settings=settings))
    features = torch.zeros(2, card.feature_count)
    pictures, seen, pairs = (torch.export.Dim(name, min=0) for name in ("pictures", "seen", "pairs"))
    height, width = torch.export.Dim("height", min=1), torch.export.Dim("width", min=1)
    inputs = {"picture": torch.zeros(2, *EXAMPLE_SIDES, 3, dtype=torch.uint8)}
    inputs |= {name: features.repeat(repeats, 1) for name, repeats in (("seen", 2), ("first", 3), ("second", 3))}
    axes: dict[str, dict[int, Any]] = {
        "picture": {0: pictures, 1: height, 2: width},
        "seen": {0: seen},
        "first": {0: pairs},
        "second": {0: pairs},
    }
    _write(path, card, EyesGraph(encoder.eyes), inputs, ["features", "stands", "whereabouts"], axes)


def check_can_export() -> None:
    """Raise DeployError where the packages of the extra `onnx` are not installed."""
    try:
        import onnx  # noqa: F401
        import onnxscript  # noqa: F401
    except ImportError as fault:
        raise DeployError(f"export needs {fault.name}. {install_hint('onnx')}") from fault


def _write(
    path: Path,
    card: Card,
    graph: torch.nn.Module,
    inputs: dict[str, torch.Tensor],
    outputs: list[str],
    axes: dict[str, dict[int, Any]],
    guard: AbstractContextManager[None] | None = None,
) -> None:
    """Write a graph with its card, sealed; it is translated behind the guard, where there is one."""
    with guard or nullcontext():
        model = _translated(graph.eval(), inputs, outputs, axes)
    _sign(model, {CARD_KEY: card.to_json(), CHECKSUM_KEY: NO_DIGEST.decode()})
    with written_whole(path) as part:
        part.write_bytes(sealed(model.SerializeToString(deterministic=True)))


def _translated(
    graph: torch.nn.Module, inputs: dict[str, torch.Tensor], outputs: list[str], axes: dict[str, dict[int, Any]]
) -> Any:
    """The graph as an ONNX model (a protocol buffer)."""
    with _quiet(), torch.no_grad():
        program = torch.onnx.export(
            graph,
            tuple(inputs.values()),
            input_names=list(inputs),
            output_names=outputs,
            dynamic_shapes=axes,
            opset_version=OPSET,
            dynamo=True,
            verbose=False,
        )
    assert program is not None
    return program.model_proto


def _sign(model: Any, metadata: dict[str, str]) -> None:
    """Say who made the model and what it is; drop the translation's notes, which name files of this machine."""
    model.producer_name, model.producer_version = "clearway", __version__
    for noted in (model, model.graph, *model.graph.node, *model.graph.value_info, *model.graph.initializer):
        noted.ClearField("doc_string")
        noted.ClearField("metadata_props")
    for key, value in metadata.items():
        model.metadata_props.add(key=key, value=value)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the translator's notes for developers off the terminal."""
    logger = logging.getLogger("torch.onnx")
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(before)
