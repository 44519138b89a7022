"""Agents that learn nothing but which pose follows which: a planner on a map, and one that goes by the nearest picture.

Where the same pose always shows the same picture, such a map is all that the paper's task needs.

Axis letters: B episodes, S states of all scenes, A actions, F features, P poses that were seen.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import shortest_path

from clearway.agents.agent import POSE, Decisions, Observation, State
from clearway.agents.chance import CHANCE, chance_of, drawn

UNSEEN = -1


class MapPlanner:
    """Takes shortest ways over steps that were seen, all that begin one alike; where none is known, any action.

    Args:
        next_state: (S, A) int64, where actions led; `UNSEEN` where they were never taken.
    """

    sees: tuple[str, ...] = (POSE,)

    def __init__(self, next_state: np.ndarray) -> None:
        self._next_state = next_state
        self.steps_to_go = steps_to_go(next_state)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; see `Agent.reset`."""
        return {"target": self._pose(target), CHANCE: chance_of(seed)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The next steps of ways that are known; see `Agent.act`."""
        here, target = self._pose(observation), state["target"]
        onward = self._next_state[here]
        left = np.where(onward == UNSEEN, np.inf, self.steps_to_go[onward, target[:, None]])
        best = np.isfinite(left) & (left + 1 == self.steps_to_go[here, target][:, None])
        best = np.where(best.any(axis=1, keepdims=True), best, True)
        decisions, chance = drawn(best / best.sum(axis=1, keepdims=True), state[CHANCE])
        return decisions, {"target": target, CHANCE: chance}

    def _pose(self, seen: Observation) -> np.ndarray:
        """(B,) int64."""
        return seen[POSE]


class NearestPicture(MapPlanner):
    """A `MapPlanner` that is not told its pose: it holds that it stands where the most similar picture was taken.

    A pose always shows the same picture here: the pose says which one is seen, and is used for nothing else.

    Args:
        next_state: (S, A) int64, see `MapPlanner`.
        features: (S, F) float32, of every pose's picture; of poses that the map lacks they are seen, not remembered.
    """

    def __init__(self, next_state: np.ndarray, features: np.ndarray) -> None:
        super().__init__(next_state)
        seen, pictures = poses_seen(next_state), features.astype(np.float64)
        remembered = pictures[seen]
        squares = (remembered**2).sum(axis=1)
        self._taken_at = seen[(squares - 2 * pictures @ remembered.T).argmin(axis=1)]  # (S,), by Euclidean distance

    def _pose(self, seen: Observation) -> np.ndarray:
        """(B,) int64: where the nearest picture of those remembered was taken."""
        return self._taken_at[seen[POSE]]


def steps_to_go(next_state: np.ndarray) -> np.ndarray:
    """(S, S) float64, fewest steps that were seen from the first state to the second; inf where no way is known."""
    here, action = np.nonzero(next_state != UNSEEN)
    onward = next_state[here, action]
    edges = csr_array((np.ones(len(here)), (here, onward)), shape=(len(next_state),) * 2)
    return shortest_path(edges, unweighted=True)


def poses_seen(next_state: np.ndarray) -> np.ndarray:
    """(P,) int64, ascending: states that an action was taken in or led to."""
    return np.union1d(np.flatnonzero((next_state != UNSEEN).any(axis=1)), next_state[next_state != UNSEEN])
