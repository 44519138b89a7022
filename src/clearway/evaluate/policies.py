"""Policies as functions: what an agent does, given where it is and where it has to go.

Axis letters: B batch, K poses of history (newest last), A actions, M targets, S states of all scenes.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from clearway.envs.world import World
from clearway.scenes.actions import ACTION_COUNT

Policy = Callable[[Tensor, Tensor], Tensor]
"""history (B, K) int64 states in the world's numbering, target (B,) int64 -> probabilities of actions (B, A).

A pure function: the same history and target give the same probabilities. They need not sum to one exactly.
"""


def random_policy() -> Policy:
    """All actions alike, whatever the pose."""

    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        return torch.full((len(target), ACTION_COUNT), 1.0 / ACTION_COUNT, device=history.device)

    return probabilities


def shortest_path_policy(world: World) -> Policy:
    """Uniform over the actions that begin a shortest path to the target; all zero where there is none."""
    steps_to_go = world.distance_table()  # (M, S)

    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        here = history[:, -1]
        after = steps_to_go[target[:, None], world.next_state[here]]  # (B, A)
        nearer = after == steps_to_go[target, here][:, None] - 1
        optimal = (nearer & (after >= 0)).to(torch.float64)
        return optimal / optimal.sum(1, keepdim=True).clamp(min=1)

    return probabilities


def argmax(policy: Policy) -> Policy:
    """The deterministic policy that takes the most probable action of `policy`, the first among equals."""

    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        best = policy(history, target).argmax(1)
        return torch.nn.functional.one_hot(best, ACTION_COUNT).to(torch.float64)

    return probabilities
