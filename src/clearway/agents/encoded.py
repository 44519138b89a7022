"""Features of what an agent sees, where an encoder makes them; or as they are given."""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import FEATURES, Observation
from clearway.perception.encoder import Encoder, sensor_of


class Encoded:
    """What is seen, as features.

    Args:
        encoder: makes the features of what is seen; None: features themselves are seen.

    Attributes:
        sees: name of what is seen.
    """

    def __init__(self, encoder: Encoder | None = None) -> None:
        self._encoder = encoder
        self.sees = FEATURES if encoder is None else sensor_of(encoder.record)

    def __call__(self, seen: Observation) -> np.ndarray:
        """Features (B, F) float32 of B observations.

        Pictures are encoded one by one: the last bits of features differ with how many are encoded at once, and an
        agent may know a picture again by them, whatever runs beside it.
        """
        given = seen[self.sees]
        if self._encoder is None:
            return given
        return np.concatenate([self._encoder.encode(given[row : row + 1]) for row in range(len(given))])

    def of_target(self, target: Observation) -> np.ndarray:
        """Features (B, F) float32 of targets, taken where they are known."""
        return target[FEATURES] if FEATURES in target else self(target)
