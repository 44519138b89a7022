"""Policies to compare an agent with, and the ways in which it can choose its actions.

Axis letters: B batch, K poses of history (newest last), A actions, M targets, S states of all scenes.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.model.policy import Policy, shortest_path_actions
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.tables import World


def random_policy() -> Policy:
    """All actions alike, whatever the pose."""

    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        return torch.full((len(target), ACTION_COUNT), 1.0 / ACTION_COUNT, device=history.device)

    return probabilities


def shortest_path_policy(world: World) -> Policy:
    """Uniform over the actions that begin a shortest path to the target; all zero where there is none."""
    steps_to_go = world.distance_table()

    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        optimal = shortest_path_actions(world, steps_to_go, history[:, -1], target).to(torch.float64)
        return optimal / optimal.sum(1, keepdim=True).clamp(min=1)

    return probabilities


def argmax(policy: Policy) -> Policy:
    """The deterministic policy that takes the most probable action of `policy`, the first among equals."""

    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        best = policy(history, target).argmax(1)
        return torch.nn.functional.one_hot(best, ACTION_COUNT).to(torch.float64)

    return probabilities
