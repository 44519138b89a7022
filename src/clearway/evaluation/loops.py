"""Counting an episode's steps, and completing walks in a circle without walking them.

An agent that is certain of every action repeats itself for ever once it stands in the same pose with the same memory.
`LoopSkipper` finds that by Brent's method (a snapshot, renewed at the powers of two, is compared with all that follows)
and adds as many whole rounds as fit below the limit; the rest is walked. The counts are exactly those of walking on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from clearway.world.navigation import Transition
from clearway.zones import ZONE_COUNT


@dataclass(frozen=True, eq=False)
class Tally:
    """Counts of B episodes: steps (B,) int64, collisions (B,) int64, zone_steps (B, Z) int64."""

    steps: Tensor
    collisions: Tensor
    zone_steps: Tensor

    @classmethod
    def zero(cls, count: int, device: torch.device) -> Tally:
        """Nothing has happened yet."""
        none = torch.zeros(count, dtype=torch.int64, device=device)
        return cls(none, none.clone(), none[:, None].repeat(1, ZONE_COUNT))

    def plus_step(self, happened: Transition) -> Tally:
        """One step later."""
        arrived = torch.nn.functional.one_hot(happened.zone, ZONE_COUNT) * ~happened.reached[:, None]
        return Tally(self.steps + 1, self.collisions + happened.blocked, self.zone_steps + arrived)

    def plus_rounds(self, rounds: Tensor, since: Tally) -> Tally:
        """`rounds` (B,) int64 times all that was counted since `since`, on top."""
        return Tally(
            self.steps + rounds * (self.steps - since.steps),
            self.collisions + rounds * (self.collisions - since.collisions),
            self.zone_steps + rounds[:, None] * (self.zone_steps - since.zone_steps),
        )

    def at(self, index: Tensor) -> Tally:
        """The counts of some episodes, by index or mask."""
        return Tally(self.steps[index], self.collisions[index], self.zone_steps[index])

    def write(self, index: Tensor, other: Tally) -> None:
        """Set the counts of the episodes in index (B,) int64."""
        self.steps[index] = other.steps
        self.collisions[index] = other.collisions
        self.zone_steps[index] = other.zone_steps


class LoopSkipper:
    """Watches B episodes for what comes back.

    Args:
        count: B.
        tally: the counts at the start.
    """

    def __init__(self, count: int, tally: Tally) -> None:
        self.walked, self.renew_at = 0, 1
        self.snapshot: Mapping[str, np.ndarray] = {}  # none yet: after the first step there is one
        self.tally = tally
        self.certain = torch.zeros(count, dtype=torch.bool, device=tally.steps.device)

    def skip(
        self, where: Mapping[str, np.ndarray], tally: Tally, certain: Tensor, step_limit: int
    ) -> tuple[Tally, Tensor]:
        """The counts after one more step, with all whole rounds below the limit where a circle has closed; where, (B,).

        Args:
            where: all that the further walk follows from but for chance, each (B, ...), after the step.
            tally: the counts after the step.
            certain: (B,) bool, the step's action was the only one possible.
            step_limit: the episodes' last step.
        """
        self.walked += 1
        self.certain = self.certain & certain
        closed = self.certain
        if bool(closed.any()):
            closed = closed & torch.from_numpy(_same(where, self.snapshot)).to(closed.device)
            tally = self._rounds_added(tally, closed, step_limit)
        if self.walked == self.renew_at:
            self.snapshot = {name: values.copy() for name, values in where.items()}  # its own, whoever writes to theirs
            self.tally, self.renew_at = tally, 2 * self.renew_at
            self.certain = torch.ones_like(self.certain)
        return tally, closed

    def keep(self, still: np.ndarray) -> None:
        """Forget the episodes where still (B,) is False."""
        kept = torch.from_numpy(still).to(self.certain.device)
        self.snapshot = {name: values[still] for name, values in self.snapshot.items()}
        self.tally, self.certain = self.tally.at(kept), self.certain[kept]

    def _rounds_added(self, tally: Tally, closed: Tensor, step_limit: int) -> Tally:
        """Whole rounds added where closed; those episodes are not watched until the snapshot is renewed."""
        length = (tally.steps - self.tally.steps).clamp(min=1)
        rounds = torch.where(closed, (step_limit - tally.steps) // length, 0)
        self.certain = self.certain & ~closed
        return tally.plus_rounds(rounds, self.tally)


def _same(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> np.ndarray:
    """(B,) bool: rows that are equal in all their arrays; none where these have other names or shapes."""
    count = len(next(iter(one.values())))
    if {name: values.shape for name, values in one.items()} != {name: values.shape for name, values in other.items()}:
        return np.zeros(count, bool)
    equal = [(one[name] == other[name]).reshape(count, -1).all(1) for name in one]
    return np.logical_and.reduce(equal)
