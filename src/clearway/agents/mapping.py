"""The mapping agent: it finds out where it is, where a body can stand and where the target is, and walks by that.

It learns nothing but what its eyes were taught, so that it walks in any room. What it remembers of an episode is
beliefs over a lattice of poses. With the map of a tour it begins with what the tour has found.

Axis letters: B episodes, G cells along a side of the lattice.
"""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import LAST_ACTION, Decisions, Observation, State
from clearway.agents.encoded import Encoded
from clearway.mapping.beliefs import IMPOSSIBLE, add_sighting
from clearway.mapping.following import Follower, been_now
from clearway.mapping.held import Held, Laid, held_by
from clearway.mapping.room_map import RoomMap
from clearway.mapping.search import probabilities, search_steps
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.perception.encoder import Encoder


class MappingAgent:
    """Walks by beliefs over a lattice of poses.

    Args:
        sight: compares features.
        encoder: makes the features of what is seen; None: features themselves are seen.
        known: what a tour of this room has found; None: the room is unknown.
        settings: how it weighs things.
    """

    def __init__(
        self,
        sight: Sight,
        encoder: Encoder | None = None,
        known: RoomMap | None = None,
        settings: MappingSettings | None = None,
    ) -> None:
        self._sight, self._settings, self._has_toured = sight, settings or MappingSettings(), known is not None
        self._follower = Follower(sight, self._settings, known, last_look=not self._has_toured)
        self._features = Encoded(encoder, at_once=1)
        self.sees: tuple[str, ...] = (self._features.sees,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; a target's features are taken where they are known. See `Agent.reset`."""
        features = self._features.of_target(target)
        state = self._follower.begin(len(features))
        goal = np.zeros(state["here"].shape, np.float32)
        if self._has_toured:
            self._follower.sight_in_map(goal, features, self._settings.target_weight)
            self._follower.recognise(goal, features)
        return {"target": features, "goal": goal, **state}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The next steps of ways to where the target is likely; see `Agent.act`."""
        seen, goal = self._features(observation), state["goal"].copy()
        poses, after = self._follower.follow(seen, state)
        towards = self._sight.whereabouts(seen, state["target"])
        for row, pose in enumerate(poses):
            if not state["been"][row][pose.index]:
                add_sighting(
                    goal[row],
                    pose,
                    towards[row],
                    self._settings.target_weight,
                    self._settings.lattice,
                    after["room"][row],
                    self._settings.surest,
                )
        np.maximum(goal, self._settings.least_evidence, out=goal)
        likely = probabilities(np.where(state["been"], IMPOSSIBLE, goal), after["room"])
        there = np.array([likely[row][pose.index] for row, pose in enumerate(poses)])
        been = been_now(state["been"], poses)  # an episode that goes on has not arrived
        action, lost = search_steps(
            poses, goal, been, after["room"], after["shut"], self._settings, toured=self._has_toured
        )
        self._begin_anew(lost, been, after)
        decisions = Decisions(action, arrived=there > self._settings.arrived)
        return decisions, {**after, "target": state["target"], "goal": goal, "been": been, LAST_ACTION: action}

    def _begin_anew(self, lost: np.ndarray, been: np.ndarray, after: State) -> None:
        """Forget where episodes (B,) bool that have nowhere left to go have been, and what blocked them.

        The target is somewhere, so that some of it was wrong. The pose in which it holds that it stands may be, too.
        """
        been[lost], after["shut"][lost] = False, False
        room = after["room"]
        room[lost] = np.where(room[lost] < 0, self._settings.usual_room, room[lost])

    def holds(self, state: State, laid: Laid, row: int = 0) -> Held:
        """What it holds in one of the episodes of a state, after a step, on a map in which its lattice is laid."""
        return held_by(state, laid, self._settings.usual_room, row)
