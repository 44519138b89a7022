"""A network in one scene by what a camera sees, or by features of it.

Axis letters: B episodes, K history (newest last), F features.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from clearway.agents import memory
from clearway.agents.agent import Decisions, Observation, State
from clearway.agents.arrival import Arrival
from clearway.agents.chance import CHANCE, chance_of, drawn
from clearway.agents.encoded import Encoded
from clearway.model.policy import ScenePolicy
from clearway.perception.encoder import Encoder


class FeatureAgent:
    """Draws its actions by a network's policy in one scene.

    Args:
        policy: of the scene.
        encoder: makes the features of what is seen; None: features themselves are seen.
        arrival: says where it has arrived; None: it cannot tell.
    """

    def __init__(self, policy: ScenePolicy, encoder: Encoder | None = None, arrival: Arrival | None = None) -> None:
        self._policy, self._arrival = policy, arrival
        self._history_length = policy.history_length
        self._features = Encoded(encoder)
        self.sees: tuple[str, ...] = (self._features.sees,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; a target's features are taken where they are known. See `Agent.reset`."""
        features = self._features.of_target(target)
        count, size = features.shape
        return {
            "target": features,
            "begun": np.zeros(count, bool),
            "earlier": np.zeros((count, self._history_length - 1, size), np.float32),
            CHANCE: chance_of(seed),
        }

    @torch.inference_mode()
    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """Actions drawn by the policy; see `Agent.act`."""
        seen = memory.history(state["earlier"], state["begun"], self._features(observation))  # (B, K, F)
        probabilities, value = self._asked(torch.from_numpy(seen), torch.from_numpy(state["target"]))
        decisions, chance = drawn(probabilities.numpy(), state[CHANCE], value.numpy()[:, 0])
        if self._arrival is not None:
            decisions = replace(decisions, arrived=self._arrival(seen[:, -1], state["target"]))
        after = {"earlier": seen[:, 1:], "begun": np.ones_like(state["begun"]), CHANCE: chance}
        return decisions, {**state, **after}

    def _asked(self, history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """What the policy says, see `ScenePolicy`."""
        probabilities, value = self._policy(history, target)
        return probabilities, value
