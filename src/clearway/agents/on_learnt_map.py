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
from clearway.agents.encoded import Encoded
from clearway.perception.encoder import Encoder
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.world import World

UNSEEN = -1
WALKERS = 100
"""Random walkers that see a map together."""
MOST_A_POSE = 64
"""Frames of all walkers for every pose: enough for every step of the bathroom; larger maps may lack a pose."""


class MapPlanner:
    """Takes shortest ways over steps that were seen, all that begin one alike; where none is known, any action.

    Args:
        next_state: (S, A) int64, where actions led; `UNSEEN` where they were never taken.
        taken_for: (S,) int64, the pose that it takes each for, as of `nearest_pictures`; None: it knows them all.
    """

    sees: tuple[str, ...] = (POSE,)

    def __init__(self, next_state: np.ndarray, taken_for: np.ndarray | None = None) -> None:
        self._next_state = next_state
        self._taken_for = np.arange(len(next_state)) if taken_for is None else taken_for
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
        return self._taken_for[seen[POSE]]


class NearestPicture(MapPlanner):
    """A `MapPlanner` off the grid: it holds that it stands where the most similar picture was taken.

    Args:
        next_state: (S, A) int64, see `MapPlanner`.
        features: (S, F) float32, of every pose's picture; those of poses that were not seen are not looked at.
        encoder: makes the features of what is seen; None: features themselves are seen.
    """

    def __init__(self, next_state: np.ndarray, features: np.ndarray, encoder: Encoder | None = None) -> None:
        super().__init__(next_state)
        self._seen = poses_seen(next_state)
        self._pictures = features[self._seen].astype(np.float64)
        self._encoded = Encoded(encoder)
        self.sees = (self._encoded.sees,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; a target's features are taken where they are known. See `Agent.reset`."""
        return {"target": self._nearest(self._encoded.of_target(target)), CHANCE: chance_of(seed)}

    def _pose(self, seen: Observation) -> np.ndarray:
        """(B,) int64."""
        return self._nearest(self._encoded(seen))

    def _nearest(self, features: np.ndarray) -> np.ndarray:
        """(B, F) -> (B,) int64 states."""
        return nearest(features, self._seen, self._pictures)


def nearest_pictures(next_state: np.ndarray, features: np.ndarray) -> np.ndarray:
    """(S,) int64: of the poses that were seen, the one whose picture is most like each pose's.

    Where a pose always shows the same picture, that is all that who goes by pictures can know of it.

    Args:
        next_state: (S, A) int64, see `MapPlanner`.
        features: (S, F) float32, of every pose's picture.
    """
    seen = poses_seen(next_state)
    return nearest(features, seen, features[seen].astype(np.float64))


def nearest(features: np.ndarray, poses: np.ndarray, pictures: np.ndarray) -> np.ndarray:
    """(B, F), (P,), (P, F) float64 -> (B,): the pose, among P, whose picture is nearest by Euclidean distance."""
    alike = features.astype(np.float64) @ pictures.T
    distance = (pictures**2).sum(axis=1) - 2 * alike  # squared, less what is the same for all poses
    return poses[distance.argmin(axis=1)]


def nearest_picture(world: World, seed: int, encoder: Encoder | None = None) -> NearestPicture:
    """Who knows the pictures of a world with features, and which follows which, as random walkers have seen them.

    Args:
        world: where `WALKERS` walk, `MOST_A_POSE` frames for every pose.
        seed: of the walkers.
        encoder: see `NearestPicture`.
    """
    assert world.features is not None
    seen = seen_by_walkers(world, frames_of(world, MOST_A_POSE), seed)
    return NearestPicture(seen, world.features.float().cpu().numpy(), encoder)


def frames_of(world: World, frames_a_pose: int) -> int:
    """Frames of all walkers together, as many each, in which they take so many for every pose of the world, or more."""
    return -(-frames_a_pose * world.state_count // WALKERS) * WALKERS


def seen_by_walkers(world: World, frames: int, seed: int) -> np.ndarray:
    """(S, A) int64, where actions led that `WALKERS` random walkers took in so many frames together; else `UNSEEN`.

    Walkers begin in poses from which a target can be reached, and are never put elsewhere.
    """
    draws = np.random.default_rng(seed)
    tables = world.next_state.cpu().numpy()
    found = np.full(tables.shape, UNSEEN, np.int64)
    here = draws.choice(np.unique(world.start_state.cpu().numpy()), WALKERS)
    for first in range(0, frames, WALKERS):
        walking = slice(0, min(WALKERS, frames - first))
        action = draws.integers(ACTION_COUNT, size=WALKERS)
        after = tables[here, action]
        found[here[walking], action[walking]] = after[walking]
        here = after
    return found


def steps_to_go(next_state: np.ndarray) -> np.ndarray:
    """(S, S) float64, fewest steps that were seen from the first state to the second; inf where no way is known."""
    here, action = np.nonzero(next_state != UNSEEN)
    onward = next_state[here, action]
    edges = csr_array((np.ones(len(here)), (here, onward)), shape=(len(next_state),) * 2)
    return shortest_path(edges, unweighted=True)


def poses_seen(next_state: np.ndarray) -> np.ndarray:
    """(P,) int64, ascending: states that an action was taken in or led to."""
    return np.union1d(np.flatnonzero((next_state != UNSEEN).any(axis=1)), next_state[next_state != UNSEEN])
