"""What happens to training episodes, per target: for the progress bar, the log and the balancing of targets.

Axis letters: T steps, N environments, M targets.
"""

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor

from clearway.learn.peers import ALONE, Peers

WINDOW = 20  # episodes of a target after which its success rate is taken anew
EPISODES, REACHED, STEPS, COLLISIONS = range(4)


class Counted(Protocol):
    """What is counted of T steps of N environments, (T, N) each."""

    @property
    def target(self) -> Tensor:
        """Int64."""

    @property
    def reached(self) -> Tensor:
        """Bool."""

    @property
    def truncated(self) -> Tensor:
        """Bool."""

    @property
    def blocked(self) -> Tensor:
        """Bool."""


class EpisodeStatistics:
    """Running counts of ended episodes.

    Args:
        env_count, target_count: N, M.
        device: of the counts.
        told: (M,) bool, the targets that `solved` and `take` tell of; all by default.
        peers: what they tell is of the targets of all workers, who then ask alike.

    Attributes:
        target_count: number of targets told of.
        open_steps, open_collisions: (N,) float64, of the episodes under way.
        totals: (M, 4) float64, ended episodes, those that reached the target, their steps and collisions, since the
            last `take`.
        window: (M, 2) float64, ended and successful episodes since the success rate was last taken.
        recent_success: (M,) float64, success rate over the last window; 0 before the first.
    """

    def __init__(
        self,
        env_count: int,
        target_count: int,
        device: torch.device,
        told: Tensor | None = None,
        peers: Peers = ALONE,
    ) -> None:
        self.peers = peers
        self.told = torch.ones(target_count, dtype=torch.bool, device=device) if told is None else told
        self.target_count = self._of_all(int(self.told.sum()))
        self.open_steps = torch.zeros(env_count, dtype=torch.float64, device=device)
        self.open_collisions = torch.zeros_like(self.open_steps)
        self.totals = torch.zeros(target_count, 4, dtype=torch.float64, device=device)
        self.window = torch.zeros(target_count, 2, dtype=torch.float64, device=device)
        self.recent_success = torch.zeros(target_count, dtype=torch.float64, device=device)

    def add(self, rollout: Counted) -> None:
        """Count all steps of a rollout, and take success rates anew."""
        ended = rollout.reached | rollout.truncated
        steps = _since_the_last_end(torch.ones_like(ended), ended, self.open_steps)
        collisions = _since_the_last_end(rollout.blocked, ended, self.open_collisions)
        row = torch.stack([ended, rollout.reached, steps * ended, collisions * ended], 2).flatten(0, 1)
        target = rollout.target.flatten()
        self.totals.index_add_(0, target, row)
        self.window.index_add_(0, target, row[:, :2])
        self.open_steps, self.open_collisions = (count[-1] * ~ended[-1] for count in (steps, collisions))
        self.refresh_success()

    def drop_open(self) -> None:
        """Forget the episodes under way, which do not go on."""
        self.open_steps.zero_()
        self.open_collisions.zero_()

    def refresh_success(self) -> None:
        """Take the success rate anew for targets whose window is full."""
        full = self.window[:, EPISODES] >= WINDOW
        rate = self.window[:, REACHED] / self.window[:, EPISODES].clamp_min(1)
        self.recent_success = torch.where(full, rate, self.recent_success)
        self.window *= (~full)[:, None]

    @property
    def solved(self) -> int:
        """Number of targets told of that every episode of the last window reached."""
        return self._of_all(int((self.recent_success == 1)[self.told].sum()))

    @property
    def all_solved(self) -> bool:
        """Every target told of is solved."""
        return self.solved == self.target_count

    def take(self) -> Tensor:
        """The totals of the targets told of since the last call, (M, 4) or fewer; all start again from zero.

        Of several workers' targets they are added up, (1, 4).
        """
        totals = self.totals[self.told]
        self.totals.zero_()
        if self.peers.count > 1:
            totals = totals.sum(0, keepdim=True)
            self.peers.add_up(totals)
        return totals

    def _of_all(self, count: int) -> int:
        """A count of this worker's targets, with the others'."""
        return int(sum(theirs for [theirs] in self.peers.told(count)))

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on from here."""
        return {name: here for name, here in vars(self).items() if isinstance(here, Tensor) and name != "told"}

    def load_tensors(self, tensors: dict[str, Tensor]) -> None:
        """Go on from where `tensors` was called."""
        for name, here in self.tensors().items():
            setattr(self, name, tensors[name].to(here.device).clone())


def _since_the_last_end(flag: Tensor, ended: Tensor, before: Tensor) -> Tensor:
    """How often `flag` (T, N) was True since its environment's last end, that of its own step not counted.

    Args:
        flag, ended: (T, N) bool.
        before: (N,) float64, the count of the episode under way at the first step.

    Returns:
        (T, N) float64.
    """
    count = before + flag.cumsum(0)  # never falls, so that the greatest at an end is the last end's
    at_last_end = torch.where(ended, count, 0.0).cummax(0).values
    return count - torch.cat([torch.zeros_like(before)[None], at_last_end[:-1]])
