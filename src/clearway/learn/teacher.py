"""The exact planner as a teacher: which actions are best in every pose under the reward.

    Q(s, a) = r(s, a) + discount max_b Q(s', b), where the episode goes on;   best: Q(s, a) within 1e-6 of the greatest

It plans in the scenes' graphs, or in what of them was seen.

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
UNKNOWN = -1
WORST = -1e6  # value of a pose out of which no way is known


class Teacher:
    """Best actions, for every target in its own scene's states.

    Args:
        world: the tables and targets.
        reward: what is earned.
        discount: below 1, or such that every best walk arrives.
        seen: (S, A) int64, where actions are known to lead, `UNKNOWN` where not; None: all is known.

    Attributes:
        pairs: (P, 2) int64, every target with every state from which a way to it is known, ordered by target.

    Raises:
        RunError: under the reward and the discount values do not settle.
    """

    def __init__(self, world: World, reward: Reward, discount: float, seen: Tensor | None = None) -> None:
        offset = world.scene_offset
        self._first = offset[world.target_scene]
        states = torch.diff(offset)[world.target_scene]
        self._offset = states.cumsum(0) - states
        table = torch.from_numpy(reward.table(world.moves())).to(world.device, torch.float64)  # (2, S, A)
        leads = world.next_state if seen is None else seen
        best, value, ways, pairs = [], [], [], []
        for scene in torch.unique(world.target_scene).tolist():
            first, last = offset[scene : scene + 2].tolist()
            target = (world.target_scene == scene).nonzero()[:, 0]
            goal = world.target_state[target] - first
            earned, known = table[:, first:last], leads[first:last] != UNKNOWN
            onward = torch.where(known, leads[first:last] - first, 0)
            found = _planned(earned, onward, known, goal, discount)
            best.append(found[0].flatten(0, 1))
            value.append(found[1].flatten())
            ways.append(_on_a_way(onward, known, goal))
            row, state = ways[-1].nonzero(as_tuple=True)
            pairs.append(torch.stack([target[row], state + first], 1))
        self._best, self._value, self.pairs = torch.cat(best), torch.cat(value), torch.cat(pairs)
        self._has_way = torch.cat([way.flatten() for way in ways])

    def __getitem__(self, index: tuple[Tensor, Tensor]) -> Tensor:
        """(B, A) bool, the best actions towards targets (B,) in states (B,) of their scenes, int64 both."""
        return self._best[self._row(*index)]

    def value(self, target: Tensor, state: Tensor) -> Tensor:
        """(B,) float64, what best walks towards targets (B,) earn from states (B,) of their scenes, int64 both."""
        return self._value[self._row(target, state)]

    def has(self, target: Tensor, state: Tensor) -> Tensor:
        """(B,) bool, whether a way to targets (B,) from other states (B,) of their scenes is known, int64 both."""
        return self._has_way[self._row(target, state)]

    def _row(self, target: Tensor, state: Tensor) -> Tensor:
        return self._offset[target] + state - self._first[target]


def _planned(earned: Tensor, onward: Tensor, known: Tensor, targets: Tensor, discount: float) -> tuple[Tensor, Tensor]:
    """Best actions (M, S, A) bool and values (M, S) of one scene.

    Args: rewards (2, S, A), next states (S, A) and whether they are known, targets (M,), the discount.
    """
    arrives = known & (onward[None] == targets[:, None, None])  # (M, S, A)
    earned = torch.where(arrives, earned[1], earned[0])
    value = torch.zeros(arrives.shape[:2], dtype=earned.dtype, device=earned.device)
    for _ in range(MOST_SWEEPS):
        worth = earned + discount * torch.where(arrives, 0.0, value[:, onward])
        worth = torch.where(known, worth, WORST)
        better = worth.amax(dim=2)
        settled = (better - value).abs().amax() < TOLERANCE / 10
        value = better
        if settled:
            return worth >= better[..., None] - TOLERANCE, value
    raise RunError(f"the best walks are not settled after {MOST_SWEEPS} sweeps. Give a discount below 1")


def _on_a_way(onward: Tensor, known: Tensor, targets: Tensor) -> Tensor:
    """(M, S) bool, states of one scene from which known actions lead to targets (M,), those left out."""
    at_target = torch.arange(len(onward), device=onward.device) == targets[:, None]
    found = at_target
    while True:
        wider = found | (known & found[:, onward]).any(dim=2)
        if (wider == found).all():
            return found & ~at_target
        found = wider
