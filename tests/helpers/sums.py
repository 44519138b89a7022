"""`Sums`: an agent without a network, whose answers are exact and tell which pictures they rest on."""

from __future__ import annotations

import time

import numpy as np

from clearway.agents import memory
from clearway.agents.agent import Decisions, Observation, State
from clearway.agents.chance import CHANCE, chance_of, drawn
from clearway.deploy.card import Card
from clearway.scenes.sensors import RGB, rgb

NAMES = ("move forward", "turn right", "turn left", "move backward")
CARD = Card("attic", NAMES, 4, 2, True, {"name": "sums"}, {}, (3, 4), {}, rgb(3, 4).to_json())


class Sums:
    """Values are the sum of the means of the last four pictures plus 1000 times the target's mean.

    Args:
        seconds: that every batch takes.
    """

    card = CARD
    sees = (RGB,)

    def __init__(self, seconds: float = 0.0) -> None:
        self.seconds = seconds
        self.batches: list[int] = []

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        means = self._means(target)
        begin = {"begun": np.zeros(len(means), bool), "earlier": np.zeros((len(means), 3), np.float32)}
        return {"target": means, **begin, CHANCE: chance_of(seed)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        seen = memory.history(state["earlier"], state["begun"], self._means(observation))
        told = np.array([[0.1, 0.2, 0.3, 0.4]], np.float32).repeat(len(seen), axis=0)
        decisions, chance = drawn(told, state[CHANCE], seen.sum(1) + 1000 * state["target"])
        after = {"earlier": seen[:, 1:], "begun": np.ones_like(state["begun"]), CHANCE: chance}
        return decisions, {**state, **after}

    def _means(self, seen: Observation) -> np.ndarray:
        """(B,) float32, of pictures (B, height, width, 3)."""
        time.sleep(self.seconds)
        self.batches.append(len(seen[RGB]))
        return seen[RGB].mean(axis=(1, 2, 3)).astype(np.float32)


def plain(level: int, size: tuple[int, int] = (3, 4)) -> np.ndarray:
    """A picture of one grey level."""
    return np.full((*size, 3), level, np.uint8)
