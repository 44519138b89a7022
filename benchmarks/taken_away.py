"""The generalist without what it did before in an episode, and without the cells of its tour's map.

What memory and map bring is what is lost without them; `generalist.py --rivals` asks for these.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from clearway.agents.agent import Agent, Decisions, Observation, State
from clearway.agents.generalist import Generalist
from clearway.agents.mapping import MappingAgent
from clearway.agents.tour_map import map_of

if TYPE_CHECKING:
    from clearway.world.world import World


class Forgetful:
    """Takes every step as if it were the first of its episode.

    Args:
        agent: walks.
    """

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self.sees = agent.sees

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        return self._agent.reset(target, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The state stays that of the beginning; see `Agent.act`."""
        decisions, _ = self._agent.act(observation, state)
        return decisions, state


class WithoutMemory(Generalist):
    """Tours as the generalist does, and keeps the tour's map, but nothing of an episode."""

    def on_poses(self, world: World) -> Forgetful:  # type: ignore[override]  # an agent, too
        """See `Generalist.on_poses`."""
        return Forgetful(super().on_poses(world))

    def after(self, state: State, *, camera: bool = False) -> Forgetful:  # type: ignore[override]  # an agent, too
        """See `Generalist.after`."""
        return Forgetful(super().after(state, camera=camera))


class WithoutCells(Generalist):
    """Tours as the generalist does, and keeps the tour's pictures with their poses, but not which cells are free."""

    def after(self, state: State, *, camera: bool = False) -> MappingAgent:
        """See `Generalist.after`."""
        known = map_of(state, self.sight, self.settings)
        unknown = np.full_like(known.room, self.settings.usual_room)
        known = replace(known, room=unknown, shut=np.zeros_like(known.shut))
        return MappingAgent(self.sight, self.encoder if camera else None, known, self.settings)
