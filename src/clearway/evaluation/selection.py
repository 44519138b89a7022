"""How an agent chooses among the actions that its policy gives probabilities for.

sampled         drawn with their probabilities, as in the paper
argmax          always the most probable one; an agent whose history repeats walks in a circle for ever
argmax-untried  the most probable of those that the episode has not tried in this pose yet; once all are tried, all
                count as untried again

The last is as deterministic as argmax and the same until the agent comes back to a pose, but no circle lasts: in a pose
visited without end every action is taken without end, so every neighbour is visited without end too, and by induction
the target, if it can be reached from there. (A rotor walk whose order of actions is the policy's: Priezzhev, Dhar, Dhar
& Krishnamurthy 1996; Yanovski, Wagner & Bruckstein 2003.) The agent has to recognise a view that it has had before in
the episode, which the paper's agent does not.

Axis letters: N episodes, B of them still walking, S states of a scene, A actions.
"""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor

from clearway.scenes.actions import ACTION_COUNT

ActionSelection = Literal["sampled", "argmax", "argmax-untried"]
_ALL_TRIED = (1 << ACTION_COUNT) - 1


class UntriedActions:
    """Which actions every episode has not tried yet in which pose.

    Args:
        episode_count: N.
        state_count: S, of the largest scene.
        device: where to keep it.
    """

    def __init__(self, episode_count: int, state_count: int, device: torch.device) -> None:
        self.tried = torch.zeros(episode_count, state_count, dtype=torch.uint8, device=device)  # a bit an action
        self.bit = torch.arange(ACTION_COUNT, device=device)

    def choose(self, episode: Tensor, state: Tensor, probabilities: Tensor) -> Tensor:
        """The most probable untried actions, (B,) int64; they are tried from now on.

        Args:
            episode: (B,) int64, all different.
            state: (B,) int64, where they are.
            probabilities: (B, A).
        """
        tried = self.tried[episode, state]
        was_tried = (tried[:, None] >> self.bit & 1).bool()
        action = probabilities.masked_fill(was_tried, -1.0).argmax(1)
        tried = tried | (1 << action).to(torch.uint8)
        self.tried[episode, state] = torch.where(tried == _ALL_TRIED, 0, tried)
        return action
