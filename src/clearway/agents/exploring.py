"""The explorer: it tours a room to see all of it, and keeps what it has seen for a `MappingAgent`.

Axis letters: B episodes, N pictures at most, F features, G cells along a side of the lattice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.agents.agent import LAST_ACTION, Decisions, Observation, State
from clearway.agents.encoded import Encoded
from clearway.agents.tour_map import LONGEST_WALK, found_anew, walk_of
from clearway.mapping.beliefs import LatticePose
from clearway.mapping.following import Follower, been_now
from clearway.mapping.lattice import AHEAD
from clearway.mapping.routes import shifted
from clearway.mapping.search import search_steps
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.perception.encoder import Encoder

AGAIN_EVERY = 100  # steps, after which all poses of a tour are found anew
LITTLE_NEWS = (-4.0, -3.0, -1.5)
"""Evidence that a pose shows something new, one, two and three cells from one with its heading that was come to."""


class Explorer:
    """Goes to poses in which it has not been.

    Args:
        sight: compares features.
        pictures: N, to be kept.
        encoder: makes the features of what is seen; None: features themselves are seen.
        settings: how it weighs things.
    """

    def __init__(
        self,
        sight: Sight,
        pictures: int,
        encoder: Encoder | None = None,
        settings: MappingSettings | None = None,
    ) -> None:
        self._settings, self._pictures = settings or MappingSettings(), pictures
        self._sight = sight
        self._follower = Follower(sight, self._settings, pictures=pictures)
        self._features = Encoded(encoder, at_once=1)
        self.sees: tuple[str, ...] = (self._features.sees,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B tours; targets are of no interest. See `Agent.reset`.

        Beside the follower's beliefs a state has `done` (B,) bool, whether there is nowhere left to go, and the walk so
        far: `walked` (B,) int64 pictures, and of the first W (N or `LONGEST_WALK`) of them `features_walked` (B, W, F)
        float16, `actions_walked` (B, W) int64 and `poses_walked` (B, W, 3) int64, as held then or found since.
        """
        count, kept = len(seed), min(self._pictures, LONGEST_WALK)
        return {
            "done": np.zeros(count, bool),
            "walked": np.zeros(count, np.int64),
            "features_walked": np.zeros((count, kept, self._sight.feature_count), np.float16),
            "actions_walked": np.zeros((count, kept), np.int64),
            "poses_walked": np.zeros((count, kept, 3), np.int64),
            **self._follower.begin(count),
        }

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The next steps to where it has not been; see `Agent.act`."""
        seen = self._features(observation)
        poses, after = self._follower.follow(seen, state)
        held = state["poses_walked"].copy()
        for row in np.flatnonzero((state["walked"] > 0) & (state["walked"] % AGAIN_EVERY == 0)).tolist():
            walk = walk_of({**state, "repeats": after["repeats"]}, row, (seen[row], poses[row]))
            doubts = bool(state["done"][row])
            if walk and (known := found_anew(walk, self._sight, self._settings, doubts=doubts)):
                poses[row] = self._follower.go_by(known, after, row)
                held[row, : len(known.taken) - 1] = known.taken[:-1]
        been = been_now(after["been"], poses)
        news, room, shut = _unlike(been), after["room"], after["shut"]
        action, done = search_steps(poses, news, been, room, shut, self._settings, in_view=0.0, toured=True)
        walked = _walked_on({**state, "poses_walked": held}, seen, action, poses)
        return Decisions(action), {**after, **walked, "been": been, LAST_ACTION: action, "done": done}


def _walked_on(
    state: State, seen: np.ndarray, action: np.ndarray, poses: Sequence[LatticePose]
) -> dict[str, np.ndarray]:
    """The walks of a state, with pictures (B, F), what is done after them (B,), and B poses of theirs."""
    walk = {name: state[name].copy() for name in ("walked", "features_walked", "actions_walked", "poses_walked")}
    rows = np.flatnonzero(walk["walked"] < walk["actions_walked"].shape[1])
    numbers = walk["walked"][rows]
    walk["features_walked"][rows, numbers], walk["actions_walked"][rows, numbers] = seen[rows], action[rows]
    walk["poses_walked"][rows, numbers] = np.array([pose.index for pose in poses])[rows]
    walk["walked"] += 1
    return walk


def _unlike(been: np.ndarray) -> np.ndarray:
    """(B, 4, G, G) float32, evidence that a pose shows something new: near a pose that was come to, little."""
    news, reached = np.zeros(been.shape, np.float32), been
    for little in LITTLE_NEWS:
        columns = reached | shifted(reached, AHEAD[0], False) | shifted(reached, AHEAD[2], False)
        reached = columns | shifted(columns, AHEAD[1], False) | shifted(columns, AHEAD[3], False)
        news = np.where(reached & (news == 0), little, news)
    return news.astype(np.float32)
