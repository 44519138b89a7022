"""PPO: several passes over each rollout, with clipped probability ratios (Schulman et al., 2017); see `trainer`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from clearway.learn.on_policy import OnPolicy


@dataclass(frozen=True)
class PPO(OnPolicy):
    """PPO with hindsight and look-ahead; why each part is there, with figures: docs/learning.md."""

    algorithm: ClassVar[str] = "ppo"

    epochs: int = 2
    """Passes over each rollout."""
    minibatches: int = 4
    """Parts that each pass is divided into."""
    siamese_step: Literal["minibatch", "pass"] = "pass"
    """When the first layer's weight moves, which costs most: with every minibatch, or once a pass with the mean of its
    minibatches' gradients."""
    ratio_clip: float = 0.2
    """PPO's clip of the probability ratio."""
