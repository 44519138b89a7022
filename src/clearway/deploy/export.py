"""Writes an agent as one ONNX file: the policy alone, or with the encoder before it."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
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
from clearway.learn.foreign_agent import faults_of_agent, is_ours
from clearway.learn.load import TrainedNetwork
from clearway.mapping.settings import MappingSettings
from clearway.model.policy import ScenePolicy
from clearway.perception.encoder import NetworkEncoder
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
        PluginError: the agent is another package's, and its network fails, or cannot be translated.
    """
    check_can_export()
    encoder = exportable_encoder(chosen) if with_encoder else None
    if on_begin is not None:
        on_begin()
    policy, card = chosen.policy, chosen.card(encoder)
    alone = _of_policy(policy, card)
    with faults_of_agent(chosen.trained, "its network"), torch.no_grad():
        policy.eval()(*alone.inputs.values())  # in training, layers such as BatchNorm1d would learn from it
    graph = alone if encoder is None else _of_pictures(policy, encoder, alone)
    try:
        model = _translated(graph)
    except (Exception, SystemExit):  # whose fault it is, a second translation tells
        if not is_ours(chosen.trained):
            _check_translates(chosen.trained, alone)
        raise
    _write(path, card, model)


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
    graph = _Graph(EyesGraph(encoder.eyes), inputs, ("features", "stands", "whereabouts"), axes)
    _write(path, card, _translated(graph))


def check_can_export() -> None:
    """Raise DeployError where the packages of the extra `onnx` are not installed."""
    try:
        import onnx  # noqa: F401
        import onnxscript  # noqa: F401
    except ImportError as fault:
        raise DeployError(f"export needs {fault.name}. {install_hint('onnx')}") from fault


@dataclass(frozen=True)
class _Graph:
    """What is translated.

    Attributes:
        module: computes it.
        inputs: examples, by the names of its arguments.
        outputs: their names.
        axes: those of any length, by input.
    """

    module: torch.nn.Module
    inputs: dict[str, torch.Tensor]
    outputs: tuple[str, ...]
    axes: dict[str, dict[int, Any]]


def _of_policy(policy: ScenePolicy, card: Card) -> _Graph:
    """The policy alone: history (B, K, F) and target (B, F) to probabilities and value."""
    history = torch.zeros(2, card.history_length, card.feature_count)
    batch = torch.export.Dim("batch", min=1)
    inputs = {"history": history, "target": history[:, 0].clone()}
    return _Graph(policy, inputs, ("probabilities", "value"), {name: {0: batch} for name in inputs})


def _of_pictures(policy: ScenePolicy, encoder: NetworkEncoder, alone: _Graph) -> _Graph:
    """The policy behind the encoder, see `AgentGraph`.

    Args:
        policy, encoder: of the agent.
        alone: the policy's own graph.
    """
    batch = alone.axes["history"][0]
    height, width = torch.export.Dim("height", min=1), torch.export.Dim("width", min=1)
    picture = torch.zeros(2, *EXAMPLE_SIDES, 3, dtype=torch.uint8)
    inputs = {"picture": picture, "start": torch.zeros(2, dtype=torch.bool), **alone.inputs}
    axes = {"picture": {0: batch, 1: height, 2: width}, "start": {0: batch}, **alone.axes}
    return _Graph(AgentGraph(policy, encoder), inputs, (*alone.outputs, "history_after"), axes)


def _check_translates(trained: TrainedNetwork, alone: _Graph) -> None:
    """Find whether another package's policy is why its graph cannot be translated.

    Raises:
        PluginError: the policy alone cannot be translated.
        Exception: the translator's own; not even a plain layer can be.
    """
    plain = torch.nn.Linear(1, 1)
    _translated(_Graph(plain, {"input": torch.zeros(2, 1)}, ("output",), {"input": {0: torch.export.Dim("batch")}}))
    with faults_of_agent(trained, "translating its network"):
        _translated(alone)


def _write(path: Path, card: Card, model: Any) -> None:
    """Write a model with its card, sealed."""
    _sign(model, {CARD_KEY: card.to_json(), CHECKSUM_KEY: NO_DIGEST.decode()})
    with written_whole(path) as part:
        part.write_bytes(sealed(model.SerializeToString(deterministic=True)))


def _translated(graph: _Graph) -> Any:
    """The graph as an ONNX model (a protocol buffer)."""
    with _quiet(), torch.no_grad():
        program = torch.onnx.export(
            graph.module.eval(),
            tuple(graph.inputs.values()),
            input_names=list(graph.inputs),
            output_names=list(graph.outputs),
            dynamic_shapes=graph.axes,
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
