"""What eyes tell of pictures, as evidence: how much likelier something is for what is seen.

Axes: B pictures, P pairs, F features.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from clearway.perception.eyes_network import Eyes
from clearway.perception.whereabouts import ELSEWHERE

LEAST, MOST = -4.0, 8.0  # of evidence, nats: eyes are never surer
AT_ONCE = 512  # pairs


class Sight:
    """Frozen eyes that compare features.

    Args:
        eyes: made the features: descriptions, then tokens.
    """

    def __init__(self, eyes: Eyes) -> None:
        self._eyes = eyes.eval()
        seen = eyes.whereabouts_seen
        self._usual = (seen / seen.sum()).log()
        stood = (eyes.stood[:-1] / eyes.stood[-1]).clamp(1e-3, 1 - 1e-3)
        self._usual_stands = torch.logit(stood)

    @property
    def feature_count(self) -> int:
        """F."""
        shape = self._eyes.shape
        return shape.description_width + shape.grid.count * shape.token_width

    def description(self, features: np.ndarray) -> np.ndarray:
        """(B, description_width) unit vectors of features (B, F)."""
        return features[:, : self._eyes.shape.description_width]

    @torch.inference_mode()
    def stands(self, features: np.ndarray) -> np.ndarray:
        """(B, 63) float32, evidence that the body could stand at each of `around.PLACES_M`."""
        glance = self._eyes.glance(self._tokens(features))
        return (glance.stands - self._usual_stands).clamp(LEAST, MOST).numpy()

    @torch.inference_mode()
    def whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(P, ELSEWHERE) float32: evidence that the second camera is in each bin rather than elsewhere, of (P, F)."""
        parts = [
            self._whereabouts(first[b : b + AT_ONCE], second[b : b + AT_ONCE]) for b in range(0, len(first), AT_ONCE)
        ]
        return np.concatenate(parts) if parts else np.zeros((0, ELSEWHERE), np.float32)

    def _whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        here, there = self._tokens(first), self._tokens(second)
        depths = [self._eyes.depth(tokens)[..., 0] for tokens in (here, there)]
        told = self._eyes.compare(here, there, *depths)
        evidence = (torch.log_softmax(told.whereabouts, dim=1) - self._usual).clamp(LEAST, MOST)
        return (evidence[:, :ELSEWHERE] - evidence[:, ELSEWHERE:]).numpy()

    def _tokens(self, features: np.ndarray) -> Tensor:
        shape = self._eyes.shape
        tokens = torch.from_numpy(np.asarray(features[:, shape.description_width :], np.float32))
        return tokens.unflatten(1, (shape.grid.count, shape.token_width))
