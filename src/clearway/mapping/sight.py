"""`Sight`: what eyes tell of pictures, as evidence: how much likelier something is for what is seen.

Whoever computes it is a `Sight`: `eyes_sight` by PyTorch, `deploy.onnx_eyes` by an exported file.

Axes: B pictures, P pairs, F features.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np


class Sight(Protocol):
    """Compares features that eyes have made."""

    @property
    def feature_count(self) -> int:
        """F."""

    def description(self, features: np.ndarray) -> np.ndarray:
        """(B, description_width) unit vectors of features (B, F)."""

    def stands(self, features: np.ndarray) -> np.ndarray:
        """(B, 63) float32, evidence that the body could stand at each of `around.PLACES_M`."""

    def whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(P, ELSEWHERE) float32: evidence that the second camera is in each bin rather than elsewhere, of (P, F)."""
