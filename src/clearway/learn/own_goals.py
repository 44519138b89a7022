"""Own goals: poses that the learner has passed and walks to again, as if they were targets (`goals` in `on_policy`).

The environment pays for the given targets only. In an episode towards an own goal, and in hindsight's rows, the learner
counts by itself what the same reward would have paid there. A pose becomes an own goal once an environment has stood in
it, and no sooner; the scene's held-out poses never do. The agent stays what it is: it acts from pictures alone.

Axis letters: T steps, N environments, S states, M goals (given targets and poses that may become own ones), C scenes,
J goals of a scene.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.world.navigation import TargetChoice
from clearway.world.world import World

OWN_SHARE = 0.5  # of the episodes, as soon as there are own goals
TOLD_SHARE = 0.25  # of the own goals, drawn anew every update, that hindsight tells of: every pose passed is one
TOLD_SALT = 1_000_037


def goal_world(world: World) -> World:
    """The world with every pose that may become an own goal among its targets, in each scene after the given ones."""
    goals: dict[str, list[int]] = {}
    for scene, name in enumerate(world.scene_names):
        first, last = world.scene_offset[scene : scene + 2].tolist()
        given = (world.target_state[world.target_scene == scene] - first).tolist()
        possible = world.may_be_target[first:last].clone()
        possible[given] = False
        goals[name] = given + possible.nonzero()[:, 0].tolist()
    return world.with_targets(goals)


class OwnGoals:
    """Which goals may be walked to.

    Args:
        world: of `goal_world`.
        given: (M',) int64, the states of the given targets.

    Attributes:
        given: (M,) bool, the goal is a given target.
        known: (M,) bool, it is, or the learner has seen its pose.
    """

    def __init__(self, world: World, given: Tensor) -> None:
        self.state, self.state_count = world.target_state, world.state_count
        self.given = torch.isin(world.target_state, given)
        self.known = self.given.clone()

    def see(self, state: Tensor) -> None:
        """Remember poses (...) int64 in which environments have stood."""
        seen = torch.zeros(self.state_count, dtype=torch.bool, device=state.device)
        seen[state.flatten()] = True
        self.known |= seen[self.state]

    @property
    def count(self) -> int:
        """Own goals that there are by now."""
        return int((self.known & ~self.given).sum())

    def told(self, seed: int, update: int) -> Tensor:
        """(M,) bool, the goals that hindsight tells of in that update: the given ones and some of the own."""
        generator = torch.Generator(self.given.device).manual_seed(seed * TOLD_SALT + update)
        drawn = torch.rand(len(self.given), generator=generator, device=self.given.device) < TOLD_SHARE
        return self.given | self.known & drawn

    def weights(self, choice: TargetChoice, weight: Tensor) -> Tensor:
        """Weights (C, J) by which goals are drawn: `OWN_SHARE` of the episodes go to own ones, where there are any.

        Args:
            choice: how goals are drawn; the padding of its members stays 0.
            weight: (M,) of a goal among those of its kind.
        """
        first_of_run = torch.ones_like(choice.members, dtype=torch.bool)
        first_of_run[:, 1:] = choice.members[:, 1:] != choice.members[:, :-1]  # padding repeats the last
        kinds = [
            torch.where(first_of_run & kind[choice.members], weight[choice.members], 0.0)
            for kind in (self.given, self.known & ~self.given)
        ]
        given, own = (kind / kind.sum(1, keepdim=True).clamp_min(torch.finfo(kind.dtype).tiny) for kind in kinds)
        return (1 - OWN_SHARE) * given + OWN_SHARE * own
