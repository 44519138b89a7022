"""ONNX files of agents: read with onnxruntime alone, and refused once a byte has changed.

The metadata entry `clearway.sha256` holds the SHA-256 of the whole file, computed with zeros in its own place. It is
found by its bytes, so that no parser sees a file before it was checked.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clearway.agents import memory
from clearway.agents.agent import FEATURES, Decisions, Observation, State
from clearway.agents.arrival import Arrival, arrival_of_json
from clearway.agents.chance import CHANCE, chance_of, drawn
from clearway.deploy.agent import sight_of
from clearway.deploy.card import ARRIVAL, EXPORT_AGAIN, SIAMESE, Card, card_from_json
from clearway.deploy.onnx_graph_check import problem_of
from clearway.deploy.onnx_session import BoundedSession
from clearway.errors import DeployError
from clearway.regular_files import read_bytes

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


@dataclass(frozen=True)
class OnnxFile:
    """An exported agent's file, open.

    Attributes:
        session: runs it.
        card: what the agent is.
        source: the path, for errors.
    """

    session: BoundedSession
    card: Card
    source: str

    def run(self, shapes: Mapping[str, tuple[int, ...]], given: Mapping[str, np.ndarray]) -> list[np.ndarray]:
        """The graph's outputs of these names and shapes, by its inputs.

        Raises:
            DeployError: one is of another shape or not finite; or as of `BoundedSession.run`.
        """
        outputs = self.session.run(list(shapes), given)
        for (name, shape), output in zip(shapes.items(), outputs, strict=True):
            if output.shape != shape:
                problem = f"its graph puts out {name} of shape {output.shape}, where its card says {shape}"
                raise DeployError(f"{self.source}: {problem}. {EXPORT_AGAIN}")
            if not np.isfinite(output).all():
                raise DeployError(f"{self.source}: its graph puts out {name} that are not finite. {EXPORT_AGAIN}")
        return outputs


def read_onnx(path: Path, threads: int | None = None) -> OnnxFile:
    """An exported agent's file.

    Args:
        path: the file.
        threads: processor threads; None: one a core.

    Raises:
        DeployError: there is no such file, it is no exported agent, was changed, or asks for what none does, or
            onnxruntime is not installed.
    """
    content = _content(path)
    check_seal(content, str(path))
    _check_graph(content, str(path))
    session = BoundedSession(content, str(path), threads)
    return OnnxFile(session, card_from_json(session.metadata.get(CARD_KEY, ""), str(path)), str(path))


class OnnxAgent:
    """The paper's network in one scene, exported, on onnxruntime; see `DeployedAgent`.

    Args:
        file: that holds it.

    Raises:
        DeployError: it holds another kind of agent, or its card is damaged.
    """

    def __init__(self, file: OnnxFile) -> None:
        self._file, self.card = file, file.card
        if self.card.kind != SIAMESE:
            problem = f"{file.source}: holds an agent of the kind {self.card.kind!r:.40}, unknown to this clearway"
            raise DeployError(f"{problem}. Upgrade clearway")
        self.sees: tuple[str, ...] = (sight_of(self.card),)
        self._arrival = _arrival_of(file)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; a target's features are taken where they are known. See `Agent.reset`."""
        features = target[FEATURES] if FEATURES in target else self._features(target)
        count, size = features.shape
        return {
            "target": features,
            "begun": np.zeros(count, bool),
            "history": np.zeros((count, self.card.history_length, size), np.float32),
            CHANCE: chance_of(seed),
        }

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """Actions drawn by what the file computes; see `Agent.act`."""
        seen = observation[self.sees[0]]
        if self.card.takes_pictures:
            probabilities, value, after = self._from_pictures(seen, ~state["begun"], state["history"], state["target"])
        else:
            after = memory.history(state["history"][:, 1:], state["begun"], seen)
            given = {"history": after, "target": state["target"]}
            probabilities, value = self._file.run(self._answers(len(seen)), given)
        if (probabilities < 0).any() or not probabilities.any(axis=1).all():
            problem = "its graph puts out probabilities that are negative, or all zero"
            raise DeployError(f"{self._file.source}: {problem}. {EXPORT_AGAIN}")
        decisions, chance = drawn(probabilities, state[CHANCE], value[:, 0])
        if self._arrival is not None:
            decisions = replace(decisions, arrived=self._arrival(after[:, -1], state["target"]))
        return decisions, {**state, "history": after, "begun": np.ones_like(state["begun"]), CHANCE: chance}

    def _features(self, target: Observation) -> np.ndarray:
        """Features (B, F) float32."""
        seen = target[self.sees[0]]
        if not self.card.takes_pictures:
            return seen
        history = np.zeros((len(seen), self.card.history_length, self.card.feature_count), np.float32)
        return self._from_pictures(seen, np.ones(len(seen), bool), history, history[:, 0])[2][:, -1]

    def _from_pictures(
        self, picture: np.ndarray, start: np.ndarray, history: np.ndarray, target: np.ndarray
    ) -> list[np.ndarray]:
        """Probabilities (B, A), value (B, 1) and history (B, K, F) after pictures; where they start, they fill it."""
        given = {"picture": picture, "start": start, "history": history, "target": target}
        return self._file.run({**self._answers(len(picture)), "history_after": history.shape}, given)

    def _answers(self, count: int) -> dict[str, tuple[int, ...]]:
        """Shapes of what the graph tells of so many episodes."""
        return {"probabilities": (count, len(self.card.actions)), "value": (count, 1)}


def _arrival_of(file: OnnxFile) -> Arrival | None:
    """By what an agent says where it has arrived; None of files that were exported before there was that."""
    kept = file.card.settings.get(ARRIVAL)
    if kept is None:
        return None
    try:
        return arrival_of_json(kept, file.card.feature_count)
    except ValueError as fault:
        raise DeployError(f"{file.source}: its metadata cannot be read ({fault}). {EXPORT_AGAIN}") from fault


def _content(path: Path) -> bytes:
    try:
        return read_bytes(path, MAX_BYTES)
    except OSError as fault:
        raise DeployError(f"{path}: cannot be read ({fault.strerror}). Check the path") from fault


def _check_graph(content: bytes, source: str) -> None:
    """Raise DeployError where a file asks for what no exported agent does."""
    try:
        problem = problem_of(content)
    except ValueError as fault:
        raise DeployError(f"{source}: not an agent's ONNX file ({fault}). {EXPORT_AGAIN}") from fault
    if problem is not None:
        raise DeployError(f"{source}: asks for {problem}, which no exported agent does. {EXPORT_AGAIN}")
