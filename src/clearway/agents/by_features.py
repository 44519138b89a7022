"""A network in one scene by what a camera sees, or by features of it.

Axis letters: B episodes, K history (newest last), F features.
"""

from __future__ import annotations

import numpy as np
import torch

from clearway.agents import memory
from clearway.agents.agent import FEATURES, Decisions, Observation, State
from clearway.agents.chance import CHANCE, chance_of, drawn
from clearway.model.policy import ScenePolicy
from clearway.perception.encoder import Encoder, sensor_of

PICTURES_AT_ONCE = 32


class FeatureAgent:
    """Draws its actions by a network's policy in one scene.

    Args:
        policy: of the scene.
        encoder: makes the features of what is seen; None: features themselves are seen.
    """

    def __init__(self, policy: ScenePolicy, encoder: Encoder | None = None) -> None:
        self._policy, self._encoder = policy, encoder
        self.sees: tuple[str, ...] = (FEATURES if encoder is None else sensor_of(encoder.record),)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; a target's features are taken where they are known. See `Agent.reset`."""
        features = target[FEATURES] if FEATURES in target else self._features(target)
        count, size = features.shape
        return {
            "target": features,
            "begun": np.zeros(count, bool),
            "earlier": np.zeros((count, self._policy.history_length - 1, size), np.float32),
            CHANCE: chance_of(seed),
        }

    @torch.inference_mode()
    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """Actions drawn by the policy; see `Agent.act`."""
        seen = memory.history(state["earlier"], state["begun"], self._features(observation))  # (B, K, F)
        probabilities, value = self._policy(torch.from_numpy(seen), torch.from_numpy(state["target"]))
        decisions, chance = drawn(probabilities.numpy(), state[CHANCE], value.numpy()[:, 0])
        after = {"earlier": seen[:, 1:], "begun": np.ones_like(state["begun"]), CHANCE: chance}
        return decisions, {**state, **after}

    def _features(self, seen: Observation) -> np.ndarray:
        """(B, F) float32."""
        given = seen[self.sees[0]]
        if self._encoder is None:
            return given
        parts = range(0, len(given), PICTURES_AT_ONCE)
        return np.concatenate([self._encoder.encode(given[b : b + PICTURES_AT_ONCE]) for b in parts])
