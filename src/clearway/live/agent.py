"""A trained agent as a policy of what it sees."""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.learn.load import Agent
from clearway.live.episodes import LivePolicy


def live_policy(agent: Agent, scene_index: int) -> LivePolicy:
    """The agent's policy in one of its run's scenes, from features of pictures."""

    @torch.no_grad()
    def probabilities(history: Tensor, target: Tensor) -> Tensor:
        scene = torch.full((len(history),), scene_index)
        scores, _ = agent.network(agent.feature_map(history), agent.feature_map(target), scene)
        return torch.softmax(scores, 1)

    return probabilities
