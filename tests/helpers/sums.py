"""`Sums`: an agent without a network, whose answers are exact and tell which pictures they rest on."""

from __future__ import annotations

import time

import numpy as np

from clearway.deploy.card import Card
from clearway.deploy.model import ModelOutput
from clearway.deploy.onnx_file import shifted
from clearway.scenes.sensors import rgb

NAMES = ("move forward", "turn right", "turn left", "move backward")
CARD = Card("attic", NAMES, 4, 2, True, {"name": "sums"}, {}, (3, 4), {}, rgb(3, 4).to_json())


class Sums:
    """Features are a picture's mean and 1; the value is the sum of the history's means plus 1000 times the target's.

    Args:
        seconds: that every batch takes.
    """

    card = CARD

    def __init__(self, seconds: float = 0.0) -> None:
        self.seconds = seconds
        self.batches: list[int] = []

    def step(self, seen: np.ndarray, start: np.ndarray, history: np.ndarray, target: np.ndarray) -> ModelOutput:
        time.sleep(self.seconds)
        self.batches.append(len(seen))
        features = np.stack([seen.mean(axis=(1, 2, 3)), np.ones(len(seen))], axis=1).astype(np.float32)
        after = shifted(history, features, start)
        probabilities = np.array([[0.1, 0.2, 0.3, 0.4]], np.float32).repeat(len(seen), axis=0)
        return ModelOutput(probabilities, after[:, :, :1].sum(1) + 1000 * target[:, :1], after)


def plain(level: int, size: tuple[int, int] = (3, 4)) -> np.ndarray:
    """A picture of one grey level."""
    return np.full((*size, 3), level, np.uint8)
