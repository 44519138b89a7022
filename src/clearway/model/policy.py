"""`Policy`: what an agent does, given where it is and where it has to go; and the network as one.

Axis letters: B batch, K poses of history (newest last), A actions.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from clearway.model.lookup import LookupNetwork
from clearway.world.tables import DistanceTable, World

Policy = Callable[[Tensor, Tensor], Tensor]
"""history (B, K) int64 states in the world's numbering, target (B,) int64 -> probabilities of actions (B, A).

A pure function: the same history and target give the same probabilities. They need not sum to one exactly.
"""


def sampled(probabilities: Tensor, uniform: Tensor) -> Tensor:
    """Actions (B,) int64 drawn by probabilities (B, A), which need not sum to one, from uniform (B,) in [0, 1).

    In float64: in float32 a number near 1 would round to 1, and the last action be drawn where it is impossible.
    """
    bounds = probabilities.to(torch.float64).cumsum(1)
    return ((uniform * bounds[:, -1])[:, None] >= bounds[:, :-1]).sum(1)


def shortest_path_actions(world: World, steps_to_go: DistanceTable, state: Tensor, target: Tensor) -> Tensor:
    """(B, A) bool: actions that begin a shortest path from states (B,) int64 to targets (B,); none without a path."""
    after = steps_to_go[target[:, None], world.next_state[state]]  # (B, A)
    return (after == steps_to_go[target, state][:, None] - 1) & (after >= 0)


Critic = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""As a `Policy`, with the value of the history too: probabilities (B, A) and values (B,)."""


def network_critic(network: LookupNetwork, world: World) -> Critic:
    """What the network says in the world whose states and targets it was made for; rows may come in any order."""
    scene_of_target = world.target_scene

    def probabilities_and_values(history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        scene = scene_of_target[target]
        order = torch.argsort(scene, stable=True)
        rows_per_scene = torch.bincount(scene, minlength=world.scene_count).tolist()
        output = network.forward(history[order], target[order], rows_per_scene)
        probabilities, values = torch.empty_like(output.scores), torch.empty_like(output.value)
        probabilities[order] = torch.softmax(output.scores, 1)
        values[order] = output.value
        return probabilities, values

    return probabilities_and_values


def network_policy(network: LookupNetwork, world: World) -> Policy:
    """The network's policy in the world whose states and targets it was made for; rows may come in any order."""
    critic = network_critic(network, world)
    return lambda history, target: critic(history, target)[0]
