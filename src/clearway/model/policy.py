"""The network as a policy: from tables for all poses of a world, plainly for one scene; and what policies share.

Axis letters: B batch, K history (newest last), F features, A actions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import torch
from torch import Tensor, nn

from clearway.model.feature_map import FeatureMap
from clearway.model.lookup import LookupNetwork
from clearway.model.network import SiameseActorCritic
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.randomness import drawn_by
from clearway.world.world import DistanceTable, World

Critic: TypeAlias = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""history (B, K) int64 states in the world's numbering, target (B,) int64 -> probabilities (B, A), values (B,)."""


def sampled(probabilities: Tensor, uniform: Tensor) -> Tensor:
    """Actions (B,) int64 drawn by probabilities (B, A) from uniform (B,) in [0, 1), see `drawn_by`."""
    return drawn_by(probabilities.to(torch.float64), uniform)


def shortest_path_actions(world: World, steps_to_go: DistanceTable, state: Tensor, target: Tensor) -> Tensor:
    """(B, A) bool: actions that begin a shortest path from states (B,) int64 to targets (B,); none without a path."""
    after = steps_to_go[target[:, None], world.next_state[state]]  # (B, A)
    return (after == steps_to_go[target, state][:, None] - 1) & (after >= 0)


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


class ScenePolicy(nn.Module):
    """Features to probabilities and value, by one scene's layers: what walks off the grid, and what is exported.

    Args:
        network: the parameters.
        feature_map: prepares features for it.
        scene: index of the scene among the run's.
        reward_scale: what the learner multiplied rewards with.
    """

    def __init__(self, network: SiameseActorCritic, feature_map: FeatureMap, scene: int, reward_scale: float) -> None:
        super().__init__()
        self.network, self.feature_map, self.scene, self.reward_scale = network, feature_map, scene, reward_scale

    @property
    def history_length(self) -> int:
        """K."""
        return self.network.shape.history_length

    def forward(self, history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """Probabilities (B, A) and value (B, 1) for features of the last K pictures (B, K, F) and the target (B, F).

        The value is in units of the reward.
        """
        fused = self.network.fused(self.feature_map(history), self.feature_map(target))
        output = self.network.head(fused, self.scene)
        return torch.softmax(output[:, :ACTION_COUNT], 1), output[:, ACTION_COUNT:] / self.reward_scale
