"""A session as bytes: what replicas of a service leave to each other, sealed so that nobody else's are taken for it.

A record is a seal, the length of a header, the header as JSON, and the agent's state as safetensors. The seal is the
keyed BLAKE2b of all that follows it.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from clearway.agents.agent import State
from clearway.deploy.navigator import Decision
from clearway.scenes.actions import Action
from clearway.serve.sessions import Answer, Progress, Session

SEAL_BYTES = 32
LENGTH = struct.Struct("<I")
MOST_HEADER_BYTES = 1 << 14  # of names, counts and an answer
KEY_BYTES = 32

Shapes = Mapping[str, tuple[np.dtype, tuple[int, ...]]]
"""Of the arrays of a state of one row, by their names."""


class UnsealedError(ValueError):
    """A record was altered, is another session's, or another agent's."""


def shapes_of(state: State) -> Shapes:
    """The arrays of a state."""
    return {name: (values.dtype, values.shape) for name, values in state.items()}


def most_record_bytes(shapes: Shapes) -> int:
    """Of a record with such a state."""
    arrays = sum(dtype.itemsize * int(np.prod(shape)) + len(name) + 200 for name, (dtype, shape) in shapes.items())
    return SEAL_BYTES + LENGTH.size + MOST_HEADER_BYTES + arrays


def sealed(session: Session, progress: Progress, key: bytes) -> bytes:
    """The record of a session at a place of its way."""
    header = {
        "id": session.id,
        "owner": session.owner,
        "selection": session.selection,
        "seed": session.seed,
        "episode": progress.episode,
        "steps": progress.steps,
        "seen": progress.seen.hex(),
        "answer": None if progress.answer is None else _told(progress.answer),
    }
    words = json.dumps(header).encode()
    state = b"" if progress.state is None else save(dict(progress.state))
    content = LENGTH.pack(len(words)) + words + state
    return _seal(content, key) + content


def unsealed(record: bytes, key: bytes, shapes: Shapes) -> tuple[dict[str, Any], Progress]:
    """What `sealed` was given: the session's header, and its progress.

    Args:
        record: of any kind.
        key: with which it was sealed.
        shapes: of the agent's state.

    Raises:
        UnsealedError: it was not sealed with this key, or not for this agent.
    """
    content = record[SEAL_BYTES:]
    if not hmac.compare_digest(_seal(content, key), record[:SEAL_BYTES]):
        raise UnsealedError("its seal does not fit")
    (length,) = LENGTH.unpack_from(content)
    header = json.loads(content[LENGTH.size : LENGTH.size + length])
    state = _state(content[LENGTH.size + length :], shapes)
    answer = header["answer"] and _answer(header["answer"])
    progress = Progress(header["episode"], header["steps"], state, bytes.fromhex(header["seen"]), answer)
    return header, progress


def _state(content: bytes, shapes: Shapes) -> State | None:
    if not content:
        return None
    try:
        state = load(content)
    except SafetensorError as fault:
        raise UnsealedError(f"its state cannot be read ({fault})") from fault
    if shapes_of(state) != shapes:
        raise UnsealedError("its state is another agent's")
    return state


def _seal(content: bytes, key: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=SEAL_BYTES, key=key).digest()


def _told(answer: Answer) -> dict[str, Any]:
    action, probabilities, value = answer.decision
    told = None if probabilities is None else [probabilities.dtype.str, probabilities.tolist()]
    return {
        "action": int(action),
        "probabilities": told,
        "value": value,
        "arrived": answer.arrived,
        "step": answer.step,
    }


def _answer(told: dict[str, Any]) -> Answer:
    kept = told["probabilities"]
    probabilities = None if kept is None else np.array(kept[1], np.dtype(kept[0]))
    return Answer(Decision(Action(told["action"]), probabilities, told["value"]), told["arrived"], told["step"])
