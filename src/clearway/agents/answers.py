"""What an agent answers is checked where it walks, so that a wrong answer is told in one line, and counts nowhere."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.agents.agent import Decisions
from clearway.errors import AgentError
from clearway.scenes.actions import ACTION_COUNT

SOMETIMES = "the agent gave arrived at some steps alone. Give it at each, or at none"


def check_state(state: object, count: int) -> None:
    """Raise AgentError where this is no state of so many episodes."""
    if not isinstance(state, Mapping):
        problem = f"the agent gave {type(state).__name__} as its state, expected arrays by name"
        raise AgentError(f"{problem}. Give {{}} where it remembers nothing")
    for name, values in state.items():
        if not isinstance(values, np.ndarray):
            problem = f"the agent's state has {name!r:.40}, {type(values).__name__}, expected an array ({count}, ...)"
            raise AgentError(f"{problem}. Give a row for each episode")
        if values.shape[:1] != (count,):
            problem = f"the agent's state has {name!r:.40} of shape {values.shape}, expected ({count}, ...)"
            raise AgentError(f"{problem}. Give a row for each episode")


def check_decisions(decisions: object, count: int) -> None:
    """Raise AgentError where these are no decisions of so many episodes."""
    if not isinstance(decisions, Decisions):
        raise AgentError(f"the agent gave {type(decisions).__name__}, expected Decisions. Give clearway.Decisions(...)")
    action, told = decisions.action, decisions.probabilities
    _check_array("actions", action, "int64", (count,))
    if told is not None:
        _check_array("probabilities", told, "float32", (count, ACTION_COUNT))
    if decisions.value is not None:
        _check_array("values", decisions.value, "float32", (count,))
        if not np.isfinite(decisions.value).all():
            raise AgentError("the agent gave values that are not finite. Give finite ones, or None")
    for name in ("certain", "arrived"):
        if (values := getattr(decisions, name)) is not None:
            _check_array(name, values, "bool", (count,))
    if action.min() < 0 or action.max() >= ACTION_COUNT:
        wrong = int(action[(action < 0) | (action >= ACTION_COUNT)][0])
        raise AgentError(f"the agent gave action {wrong}, expected 0 to {ACTION_COUNT - 1}, see scenes.actions.Action")
    if told is not None:
        total = told.astype(np.float64).sum(1)
        if not (told >= 0).all() or not ((total > 0) & np.isfinite(total)).all():  # NaN fails the comparison
            problem = "the agent gave probabilities that are negative, not finite or all zero"
            raise AgentError(f"{problem}. Give finite ones from 0 on")


def _check_array(name: str, given: object, expected: str, shape: tuple[int, ...]) -> None:
    """Raise AgentError where it is no array of this shape and kind; its numbers may be longer or shorter."""
    if isinstance(given, np.ndarray):
        if given.shape == shape and given.dtype.kind == np.dtype(expected).kind:
            return
        found = f"{given.dtype} {given.shape}"
    else:
        found = type(given).__name__
    raise AgentError(f"the agent gave {name} {found}, expected {expected} {shape}. Give a row for each episode")


def tells_arrivals(decisions: Decisions, before: bool | None) -> bool:
    """Whether the agent says if it has arrived.

    Args:
        decisions: those of a step.
        before: whether it said so at the steps before; None at the first.

    Raises:
        AgentError: it says so at some steps alone.
    """
    tells = decisions.arrived is not None
    if before not in (None, tells):
        raise AgentError(SOMETIMES)
    return tells


def arrivals_of(decisions: Decisions) -> np.ndarray:
    """(B,) bool, of an agent that says if it has arrived. Raises AgentError where it does not."""
    if decisions.arrived is None:
        raise AgentError(SOMETIMES)
    return decisions.arrived
