"""What happens to training episodes, per target: for the progress bar, the log and the balancing of targets.

Axis letters: N environments, M targets.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.envs.navigation import Transition

WINDOW = 20  # episodes of a target after which its success rate is taken anew
EPISODES, REACHED, STEPS, COLLISIONS = range(4)


class EpisodeStatistics:
    """Running counts of ended episodes.

    Attributes:
        open_steps, open_collisions: (N,) float64, of the episodes under way.
        totals: (M, 4) float64, ended episodes, those that reached the target, their steps and collisions, since the
            last `take`.
        window: (M, 2) float64, ended and successful episodes since the success rate was last taken.
        recent_success: (M,) float64, success rate over the last window; 0 before the first.
    """

    def __init__(self, env_count: int, target_count: int, device: torch.device) -> None:
        self.open_steps = torch.zeros(env_count, dtype=torch.float64, device=device)
        self.open_collisions = torch.zeros_like(self.open_steps)
        self.totals = torch.zeros(target_count, 4, dtype=torch.float64, device=device)
        self.window = torch.zeros(target_count, 2, dtype=torch.float64, device=device)
        self.recent_success = torch.zeros(target_count, dtype=torch.float64, device=device)

    def add(self, target: Tensor, step: Transition) -> None:
        """Count one step of every environment, target (N,) int64."""
        self.open_steps += 1
        self.open_collisions += step.blocked
        ended = step.ended.to(torch.float64)
        reached = step.reached.to(torch.float64)
        row = torch.stack([ended, reached, self.open_steps * ended, self.open_collisions * ended], 1)
        self.totals.index_add_(0, target, row)
        self.window.index_add_(0, target, row[:, :2])
        self.open_steps *= 1 - ended
        self.open_collisions *= 1 - ended

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
        """Number of targets that every episode of the last window reached."""
        return int((self.recent_success == 1).sum())

    def take(self) -> Tensor:
        """The totals (M, 4) since the last call, which start again from zero."""
        totals = self.totals.clone()
        self.totals.zero_()
        return totals

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on from here."""
        return dict(vars(self))

    def load_tensors(self, tensors: dict[str, Tensor]) -> None:
        """Go on from where `tensors` was called."""
        for name, here in vars(self).items():
            setattr(self, name, tensors[name].to(here.device).clone())
