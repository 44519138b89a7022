"""`EyesSight`: the evidence of frozen eyes, computed by PyTorch.

Axes: B pictures, P pairs, F features, T tokens, C numbers a token.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from clearway.perception.eyes_network import Eyes
from clearway.perception.whereabouts import ELSEWHERE

LEAST, MOST = -4.0, 8.0  # of evidence, nats: eyes are never surer
AT_ONCE = 512  # pairs


class Evidence(nn.Module):
    """What frozen eyes tell of features, as evidence; see `mapping.sight.Sight`.

    Args:
        eyes: made the features: descriptions, then tokens.
    """

    usual: Tensor
    usual_stands: Tensor

    def __init__(self, eyes: Eyes) -> None:
        super().__init__()
        self.eyes = eyes.eval()
        seen = eyes.whereabouts_seen
        stood = (eyes.stood[:-1] / eyes.stood[-1]).clamp(1e-3, 1 - 1e-3)
        self.register_buffer("usual", (seen / seen.sum()).log())
        self.register_buffer("usual_stands", torch.logit(stood))

    def stands(self, features: Tensor) -> Tensor:
        """(B, 63) of features (B, F)."""
        glance = self.eyes.glance(self._tokens(features))
        return (glance.stands - self.usual_stands).clamp(LEAST, MOST)

    def whereabouts(self, first: Tensor, second: Tensor) -> Tensor:
        """(P, ELSEWHERE) of features (P, F)."""
        here, there = self._tokens(first), self._tokens(second)
        depths = [self.eyes.depth(tokens)[..., 0] for tokens in (here, there)]
        told = self.eyes.compare(here, there, *depths)
        evidence = (torch.log_softmax(told.whereabouts, dim=1) - self.usual).clamp(LEAST, MOST)
        return evidence[:, :ELSEWHERE] - evidence[:, ELSEWHERE:]

    def _tokens(self, features: Tensor) -> Tensor:
        """(B, T, C)."""
        shape = self.eyes.shape
        return features[:, shape.description_width :].unflatten(1, (shape.grid.count, shape.token_width))


class EyesSight:
    """A `Sight` by frozen eyes.

    Args:
        eyes: made the features.
    """

    def __init__(self, eyes: Eyes) -> None:
        self._shape, self._evidence = eyes.shape, Evidence(eyes)

    @property
    def feature_count(self) -> int:
        """See `Sight`."""
        return self._shape.feature_count

    def description(self, features: np.ndarray) -> np.ndarray:
        """See `Sight`."""
        return features[:, : self._shape.description_width]

    @torch.inference_mode()
    def stands(self, features: np.ndarray) -> np.ndarray:
        """See `Sight`."""
        return self._evidence.stands(torch.from_numpy(np.ascontiguousarray(features, np.float32))).numpy()

    @torch.inference_mode()
    def whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """See `Sight`."""
        pair = [torch.from_numpy(np.ascontiguousarray(features, np.float32)) for features in (first, second)]
        parts = zip(*(features.split(AT_ONCE) for features in pair), strict=True)
        return np.concatenate([self._evidence.whereabouts(*part).numpy() for part in parts])
