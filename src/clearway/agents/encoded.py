"""Features of what an agent sees, where an encoder makes them; or as they are given."""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import FEATURES, Observation
from clearway.perception.encoder import Encoder, sensor_of

PICTURES_AT_ONCE = 32


class Encoded:
    """What is seen, as features.

    Args:
        encoder: makes the features of what is seen; None: features themselves are seen.
        at_once: most pictures that it is given at once. The last bits of features differ with how many they are: 1 for
            an agent that knows pictures again by their bits, so that it does whatever runs beside it.

    Attributes:
        sees: name of what is seen.
    """

    def __init__(self, encoder: Encoder | None = None, at_once: int = PICTURES_AT_ONCE) -> None:
        self._encoder, self._at_once = encoder, at_once
        self.sees = FEATURES if encoder is None else sensor_of(encoder.record)

    def __call__(self, seen: Observation) -> np.ndarray:
        """Features (B, F) float32 of B observations."""
        given = seen[self.sees]
        if self._encoder is None:
            return given
        parts = range(0, len(given), self._at_once)
        return np.concatenate([self._encoder.encode(given[b : b + self._at_once]) for b in parts])

    def of_target(self, target: Observation) -> np.ndarray:
        """Features (B, F) float32 of targets, taken where they are known."""
        return target[FEATURES] if FEATURES in target else self(target)
