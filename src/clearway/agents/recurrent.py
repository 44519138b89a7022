"""The recurrent agent: by features, or behind a camera, in any room.

Axis letters: B episodes, F features, H width.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from clearway.agents.agent import LAST_ACTION, Decisions, Observation, State
from clearway.agents.blocked import add_blocked, nothing_blocked, without_blocked
from clearway.agents.chance import CHANCE, chance_of, drawn
from clearway.agents.encoded import Encoded
from clearway.mapping.again import marks_of
from clearway.model.recurrent import LAST_COUNT, RecurrentActorCritic, SeenPairs, last_step, likeness
from clearway.perception.encoder import Encoder


class RecurrentAgent:
    """Draws its actions by a recurrent network, and says by it whether it has arrived.

    What was blocked is not tried again where the very same picture is seen, see `blocked`. Where the network forgets at
    every step, this is forgotten, too.

    Args:
        network: the parameters.
        pairs: compares what is seen with the target.
        encoder: makes the features of what is seen; None: features themselves are seen.
        tries_again: it may try again what was blocked.
    """

    def __init__(
        self,
        network: RecurrentActorCritic,
        pairs: SeenPairs,
        encoder: Encoder | None = None,
        *,
        tries_again: bool = False,
    ) -> None:
        self._network, self._pairs = network.eval(), pairs.eval()
        self._remembers_blocked = network.shape.remembers and not tries_again
        self._features = Encoded(encoder, at_once=1)
        self.sees: tuple[str, ...] = (self._features.sees,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; a target's features are taken where they are known. See `Agent.reset`."""
        features = self._features.of_target(target)
        count = len(features)
        return {
            "target": features,
            "hidden": np.zeros((count, self._network.shape.width), np.float32),
            "begun": np.zeros(count, bool),
            "seen": np.zeros_like(features),
            LAST_ACTION: np.zeros(count, np.int64),
            CHANCE: chance_of(seed),
            **nothing_blocked(count),
        }

    @torch.inference_mode()
    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """Actions drawn by the policy; see `Agent.act`."""
        seen = self._features(observation)
        now, target, before = (torch.from_numpy(features) for features in (seen, state["target"], state["seen"]))
        alike = likeness(self._pairs.description(now), self._pairs.description(before))
        last = last_step(torch.from_numpy(state[LAST_ACTION]), alike)
        last = torch.where(torch.from_numpy(state["begun"])[:, None], last, torch.zeros(LAST_COUNT))
        said = self._network(self._pairs(now, target), last, torch.from_numpy(state["hidden"]))
        mark = marks_of(seen)
        same = state["begun"] & (mark == marks_of(state["seen"]))
        blocked = add_blocked(state, mark, state[LAST_ACTION], same & self._remembers_blocked)
        probabilities = torch.softmax(said.scores, dim=1, dtype=torch.float64).numpy()
        allowed = without_blocked(blocked, mark, probabilities)
        decisions, chance = drawn(allowed, state[CHANCE], said.value.numpy())
        decisions = replace(decisions, arrived=said.arrived.numpy() > 0)
        after = {
            "hidden": said.hidden.numpy(),
            "begun": np.ones_like(state["begun"]),
            "seen": seen,
            LAST_ACTION: decisions.action,
            CHANCE: chance,
            **blocked,
        }
        return decisions, {**state, **after}
