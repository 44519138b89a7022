"""A2C: one pass over each rollout, as one batch (Mnih et al., 2016, made synchronous); see `trainer`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from clearway.learn.on_policy import OnPolicy


@dataclass(frozen=True)
class A2C(OnPolicy):
    """A2C, by default otherwise as PPO; as published: `presets.PAPER_A2C`."""

    algorithm: ClassVar[str] = "a2c"
