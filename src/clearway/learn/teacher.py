"""The exact planner as a teacher: which actions are best in every pose under the reward.

    Q(s, a) = r(s, a) + discount max_b Q(s', b), where the episode goes on;   best: Q(s, a) within 1e-6 of the greatest

Axis letters: M targets, S states of all scenes, A actions, B rows.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.errors import RunError
from clearway.reward import Reward
from clearway.world.world import World

TOLERANCE = 1e-6
MOST_SWEEPS = 100_000


class Teacher:
    """Best actions, for every target in its own scene's states.

    Args:
        world: the tables and targets.
        reward: what is earned.
        discount: below 1, or such that every best walk arrives.

    Raises:
        RunError: under the reward and the discount values do not settle.
    """

    def __init__(self, world: World, reward: Reward, discount: float) -> None:
        offset = world.scene_offset
        self._first = offset[world.target_scene]
        states = torch.diff(offset)[world.target_scene]
        self._offset = states.cumsum(0) - states
        table = torch.from_numpy(reward.table(world.moves())).to(world.device, torch.float64)  # (2, S, A)
        parts = []
        for scene in torch.unique(world.target_scene).tolist():
            first, last = offset[scene : scene + 2].tolist()
            targets = world.target_state[world.target_scene == scene] - first
            earned, onward = table[:, first:last], world.next_state[first:last] - first
            parts.append(_best(earned, onward, targets, discount).flatten(0, 1))
        self._best = torch.cat(parts)

    def __getitem__(self, index: tuple[Tensor, Tensor]) -> Tensor:
        """(B, A) bool, the best actions towards targets (B,) in states (B,) of their scenes, int64 both."""
        target, state = index
        return self._best[self._offset[target] + state - self._first[target]]


def _best(earned: Tensor, onward: Tensor, targets: Tensor, discount: float) -> Tensor:
    """(M, S, A) bool of one scene: rewards (2, S, A), next states (S, A), targets (M,)."""
    arrives = onward[None] == targets[:, None, None]  # (M, S, A)
    earned = torch.where(arrives, earned[1], earned[0])
    value = torch.zeros(arrives.shape[:2], dtype=earned.dtype, device=earned.device)
    for _ in range(MOST_SWEEPS):
        worth = earned + discount * torch.where(arrives, 0.0, value[:, onward])
        better = worth.amax(dim=2)
        settled = (better - value).abs().amax() < TOLERANCE / 10
        value = better
        if settled:
            return worth >= better[..., None] - TOLERANCE
    raise RunError(f"the best walks are not settled after {MOST_SWEEPS} sweeps. Give a discount below 1")
