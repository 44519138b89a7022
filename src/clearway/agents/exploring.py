"""The explorer: it tours a room to see all of it, and keeps what it has seen for a `MappingAgent`.

Axis letters: B episodes, N pictures at most, F features, G cells along a side of the lattice.
"""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import Decisions, Observation, State
from clearway.agents.encoded import Encoded
from clearway.mapping.following import Follower, been_now
from clearway.mapping.lattice import AHEAD
from clearway.mapping.room_map import RoomMap
from clearway.mapping.routes import shifted
from clearway.mapping.search import search_steps
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.perception.encoder import Encoder

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
        self._settings = settings or MappingSettings()
        self._follower = Follower(sight, self._settings, pictures=pictures)
        self._features = Encoded(encoder)
        self.sees: tuple[str, ...] = (self._features.sees,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B tours; targets are of no interest. See `Agent.reset`."""
        return self._follower.begin(len(seed))

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """The next steps to where it has not been; see `Agent.act`."""
        seen = self._features(observation)
        poses, after = self._follower.follow(seen, state)
        been = been_now(state["been"], poses)
        news, room, shut = _unlike(been), after["room"], after["shut"]
        action, _ = search_steps(poses, news, been, room, shut, self._settings, in_view=0.0, toured=True)
        return Decisions(action), {**after, "been": been, "action": action}


def _unlike(been: np.ndarray) -> np.ndarray:
    """(B, 4, G, G) float32, evidence that a pose shows something new: near a pose that was come to, little."""
    news, reached = np.zeros(been.shape, np.float32), been
    for little in LITTLE_NEWS:
        columns = reached | shifted(reached, AHEAD[0], False) | shifted(reached, AHEAD[2], False)
        reached = columns | shifted(columns, AHEAD[1], False) | shifted(columns, AHEAD[3], False)
        news = np.where(reached & (news == 0), little, news)
    return news.astype(np.float32)


def map_of(state: State, row: int = 0) -> RoomMap:
    """What an explorer's state tells of the room of one of its tours."""
    count = int(state["count"][row])
    return RoomMap(state["room"][row], state["shut"][row], state["taken"][row, :count], state["features"][row, :count])
