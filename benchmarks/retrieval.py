"""`Retrieving`: after a tour, holds that it stands where the most similar picture of the tour was taken, and plans.

The planner on a learnt map that an agent with beliefs has to beat: pictures decide alone, each for itself.
"""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import FEATURES, Decisions, Observation, State
from clearway.agents.generalist import Generalist
from clearway.agents.tour_map import map_of
from clearway.mapping.beliefs import LatticePose
from clearway.mapping.following import SURE
from clearway.mapping.lattice import HEADINGS
from clearway.mapping.room_map import RoomMap
from clearway.mapping.routes import FAR, first_action, ways_from
from clearway.mapping.sight import Sight


class Retrieval:
    """Goes by the nearest pictures of a tour, over the cells that the tour has entered.

    Args:
        sight: describes features.
        known: what the tour has found.
    """

    sees: tuple[str, ...] = (FEATURES,)

    def __init__(self, sight: Sight, known: RoomMap) -> None:
        self._sight, self._known = sight, known
        self._described = sight.description(known.features.astype(np.float32))
        free = np.where(known.room >= SURE, 1, FAR).astype(np.float32)
        self._price = np.broadcast_to(free, (1, 2, HEADINGS, *free.shape))

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Where the target was taken, for good."""
        return {"target": self._nearest(target[FEATURES])}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The next steps of shortest ways on the map."""
        here = self._nearest(observation[FEATURES])
        poses, ends = ([self._pose(number) for number in numbers] for numbers in (here, state["target"]))
        costs = ways_from(poses, self._price.repeat(len(poses), axis=0))
        action = [first_action(*way, self._price[0]) for way in zip(poses, ends, costs, strict=True)]
        return Decisions(np.array(action, np.int64), arrived=here == state["target"]), state

    def _pose(self, number: int) -> LatticePose:
        """Of a picture."""
        return LatticePose(*self._known.taken[number].tolist())

    def _nearest(self, features: np.ndarray) -> np.ndarray:
        """(B,) numbers of the tour's pictures that are most alike."""
        return (self._sight.description(features) @ self._described.T).argmax(axis=1)


class Retrieving(Generalist):
    """Tours as the generalist does, and goes by retrieval afterwards."""

    def after(self, state: State, *, camera: bool = False) -> Retrieval:  # type: ignore[override]  # an agent, too
        """See `Generalist.after`."""
        return Retrieval(self.sight, map_of(state, self.sight, self.settings))
