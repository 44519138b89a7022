"""`PretrainSettings`: how eyes are trained."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

import numpy as np

from clearway.errors import ArgumentError
from clearway.perception.eyes_network import EyesShape

WARM_UP = 200  # updates
LAST_SHARE = 0.01  # of the learning rate, at the end


@dataclass(frozen=True)
class PretrainSettings:
    """How eyes are trained.

    Attributes:
        pictures: to learn from in all; views that are seen again count again.
        batch: pictures of an update.
        together: poses of one room that come together, to be compared.
        partners: pictures that each one is compared with in an update.
        learning_rate: the highest; it rises for 200 updates and falls along a cosine.
        weight_decay: of AdamW.
        gradient_norm: gradients of more are scaled down to it.
        shape: of the network.
    """

    pictures: int = 2_000_000
    batch: int = 192
    together: int = 8
    partners: int = 4
    learning_rate: float = 1.2e-3
    weight_decay: float = 1e-2
    gradient_norm: float = 1.0
    shape: EyesShape = field(default_factory=EyesShape)

    def check(self) -> None:
        """Raises ArgumentError where there is no such training."""
        for name, number in (
            ("pictures", self.pictures),
            ("batch", self.batch),
            ("together", self.together),
            ("partners", self.partners),
        ):
            if number < 1:
                raise ArgumentError(f"{name}={number}: expected 1 or more. Give a number in that range")
        for name, value in (("learning_rate", self.learning_rate), ("gradient_norm", self.gradient_norm)):
            if not 0 < value <= 10:
                raise ArgumentError(f"{name}={value:g}: expected a number above 0, at most 10. Give one in that range")
        if not 0 <= self.weight_decay <= 10:
            problem = f"weight_decay={self.weight_decay:g}: expected a number from 0 to 10"
            raise ArgumentError(f"{problem}. Give one in that range")

    @property
    def updates(self) -> int:
        """In all."""
        return -(-self.pictures // self.batch)

    def rate_at(self, update: int) -> float:
        """Learning rate of an update, 0 the first."""
        fallen = LAST_SHARE + (1 - LAST_SHARE) * (1 + np.cos(np.pi * min(1.0, update / self.updates))) / 2
        return float(self.learning_rate * min(1.0, (update + 1) / WARM_UP) * fallen)

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {**asdict(self), "shape": self.shape.to_json()}
