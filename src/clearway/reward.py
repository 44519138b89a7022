"""The reward, as one table (paper, equation 1).

    f(s_t) = 10 at the target, alpha on an ordinary step, beta in the collision zone, gamma in the precollision zone,

by the pose the agent arrives in; a blocked move arrives in the pose it left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.zones import ZONE_COUNT, Zone


@dataclass(frozen=True)
class Reward:
    """What the agent earns for arriving in a pose."""

    name: str
    alpha: float = -0.01
    """A step into the free zone."""
    beta: float = -0.02
    """A step that ends in the collision zone."""
    gamma: float = -0.011
    """A step that ends in the precollision zone."""
    terminal: float = 10.0
    """Arriving at the target, whatever its zone."""
    blocked: float | None = None
    """A blocked move, in place of the zone's value; None: the zone's value stands."""
    clip: bool = False
    """Clip to [-1, 1] as Zhu's training loop does, so that the target is worth 1."""

    def table(self) -> np.ndarray:
        """The reward by what happened, (2, 2, 3) float64: [reached the target, blocked, zone of arrival]."""
        table = np.empty((2, 2, ZONE_COUNT))
        table[0, :, Zone.FREE] = self.alpha
        table[0, :, Zone.PRECOLLISION] = self.gamma
        table[0, :, Zone.COLLISION] = self.beta
        if self.blocked is not None:
            table[0, 1] = self.blocked
        table[1] = self.terminal
        return np.clip(table, -1.0, 1.0) if self.clip else table

    def with_changes(
        self,
        alpha: float | None = None,
        beta: float | None = None,
        gamma: float | None = None,
        terminal: float | None = None,
        clip: bool | None = None,
    ) -> Reward:
        """The same reward with the given values changed; None changes nothing."""
        return replace(
            self,
            alpha=self.alpha if alpha is None else alpha,
            beta=self.beta if beta is None else beta,
            gamma=self.gamma if gamma is None else gamma,
            terminal=self.terminal if terminal is None else terminal,
            clip=self.clip if clip is None else clip,
        )


COLLISION_AWARE = Reward("collision-aware")
"""The paper's reward."""
SHORTEST = Reward("shortest", beta=-0.01, gamma=-0.01)
"""What Zhu et al. train with: every step costs the same."""
BUMP = Reward("bump", beta=-0.01, gamma=-0.01, blocked=-0.1)
"""Zhu's environment class: a blocked move costs 0.1. Their training loop overwrites it; public ports keep it."""

REWARDS: dict[str, Reward] = {reward.name: reward for reward in (COLLISION_AWARE, SHORTEST, BUMP)}
