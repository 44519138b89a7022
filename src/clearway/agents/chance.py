"""What an agent draws: a stream of random numbers an episode, whose place is part of the agent's state.

An episode's draws follow from its seed alone, whatever runs beside it: with the same seed and the same probabilities an
agent walks the same way in the evaluation, in a live room, in the viewer and on a robot.

Axis letters: B episodes, A actions.
"""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import Decisions
from clearway.world.randomness import UNIT, drawn_by, stream_keys, stream_words

CHANCE = "clearway.chance"  # its name in a state, which no other array may have
ACTION_STREAM = 12


def chance_of(seed: np.ndarray) -> np.ndarray:
    """Streams at their begin, (B, 2) int64, from seeds (B,) int64: key, and how many numbers are drawn."""
    return np.stack([stream_keys(seed, ACTION_STREAM), np.zeros_like(seed)], axis=1)


def drawn(
    probabilities: np.ndarray, chance: np.ndarray, value: np.ndarray | None = None
) -> tuple[Decisions, np.ndarray]:
    """Actions drawn by probabilities (B, A), and the streams (B, 2) after the draw; the value (B,) is passed on."""
    keys, count = chance.T
    uniform = stream_words(keys, count) * UNIT
    action = drawn_by(probabilities.astype(np.float64), uniform)
    certain = (probabilities > 0).sum(1) == 1
    return Decisions(action, probabilities, value, certain=certain), np.stack([keys, count + 1], axis=1)
