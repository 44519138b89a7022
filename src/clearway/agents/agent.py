"""`Agent`: who walks to where a picture was taken, whatever decides there.

    state = agent.reset(target, seed)
    decisions, state = agent.act(observation, state)      # again and again

All calls are in batches of B episodes; one episode is a batch of one. An agent keeps nothing between calls: what it
remembers is in the state. A batch of episodes, a session of the service and an episode that is put aside are therefore
the same thing, and threads may share an agent.

Axis letters: B episodes, A actions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np

Observation: TypeAlias = Mapping[str, np.ndarray]
"""What is seen, by the sensor's name, each (B, ...): "rgb" (B, h, w, 3) uint8, "depth" (B, h, w) float32 metres, and
what the grid alone has: `POSE` and `FEATURES`."""

State: TypeAlias = Mapping[str, np.ndarray]
"""What an agent remembers of B episodes, by names of its own, each (B, ...)."""

POSE = "pose"
"""(B,) int64: the pose itself, in the numbering of a `World`. No robot knows it."""
FEATURES = "features"
"""(B, F) float32: what the scenes' encoder made of a picture."""

LAST_ACTION = "action"
"""(B,) int64, in the state of an agent that remembers what it did last: who chooses another action than the agent puts
it right."""


@dataclass(frozen=True, eq=False)
class Decisions:
    """What an agent does in B episodes, and what it can tell besides; None where it cannot.

    Attributes:
        action: (B,) int64 (`scenes.actions.Action`).
        probabilities: (B, A) of the actions, as it sees them; they need not sum to one exactly.
        value: (B,) discounted sum of the rewards that it expects, in units of the reward.
        arrived: (B,) bool, it holds that this is the target.
        certain: (B,) bool, the action follows from observation and state without a draw.
    """

    action: np.ndarray
    probabilities: np.ndarray | None = None
    value: np.ndarray | None = None
    arrived: np.ndarray | None = None
    certain: np.ndarray | None = None

    def rows(self, index: np.ndarray) -> Decisions:
        """Those of some of the episodes, by index or mask."""
        told = {name: values[index] for name, values in vars(self).items() if values is not None}
        return Decisions(**told)


@runtime_checkable
class Agent(Protocol):
    """Who walks to where a picture was taken; all calls are for B episodes at a time.

    What is seen is arrays by the sensor's name: "rgb" (B, height, width, 3) uint8, "depth" (B, height, width) float32
    metres, "features" (B, F) float32, and "pose" (B,) int64, which no robot knows. What is remembered, the state, is
    arrays (B, ...) by names of the agent's own, but for `LAST_ACTION`; it keeps nothing else between calls.
    """

    @property
    def sees(self) -> tuple[str, ...]:
        """Names of the sensors that it needs; it is given these, and no others."""

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes.

        Args:
            target: what is seen at the targets. It may hold "features" too, where those are known already.
            seed: (B,) int64, of all that is drawn in an episode.

        Returns:
            The state to begin with; {} where nothing is remembered.
        """

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The next actions, and what to give to the next call.

        Args:
            observation: what is seen now.
            state: of the same episodes; it stays as it is, a changed one is another. Episodes that have ended are
                gone from both.
        """


def rows(state: State, index: np.ndarray) -> State:
    """The state of some of the episodes, by index or mask."""
    return {name: values[index] for name, values in state.items()}


def joined(states: Sequence[State]) -> State:
    """The state of all episodes of several states of one agent."""
    return {name: np.concatenate([state[name] for state in states]) for name in states[0]}
