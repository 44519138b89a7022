"""Tours off the grid: an explorer walks in a room as it was built, and keeps what it has seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.agents.agent import Agent, State
from clearway.evaluation.tours import tour_begin
from clearway.live.conditions import Perturbations, as_it_was_built
from clearway.live.draws import Draws
from clearway.live.episodes import Walking, shown
from clearway.live.live_room import LiveRoom
from clearway.rooms.render import Camera
from clearway.scenes.actions import Action


@dataclass(frozen=True)
class LiveTour:
    """What a tour came to.

    Attributes:
        state: the explorer's at the end.
        contacts: moves that ended at an obstacle.
    """

    state: State
    contacts: int


def walk_live_tour(
    live: LiveRoom, explorer: Agent, camera: Camera, perturbations: Perturbations, *, steps: int, seed: int
) -> LiveTour:
    """Walk a tour from a pose of the grid's largest part that the seed draws.

    Nothing is moved and nothing new on a tour: furniture moves after it.

    Args:
        live: the room.
        explorer: who walks, by colour pictures.
        camera: takes pictures of `live.model`.
        perturbations: how strong they are.
        steps: of the tour.
        seed: of the start and of all chances.

    Raises:
        SceneError: there is nowhere to go in the room.
    """
    start, own = tour_begin(live.scene, seed)
    walker = Walking(live, start, start, Draws(own, as_it_was_built(perturbations)))
    state = explorer.reset({}, np.array([own]))
    for _ in range(steps):
        decisions, state = explorer.act(shown(explorer, [walker], camera), state)
        walker.act(Action(int(decisions.action[0])))
    return LiveTour(state, sum(step.contact for step in walker.steps))
