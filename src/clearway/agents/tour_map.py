"""The map that a tour makes, of what an `Explorer` keeps in its state.

Axis letters: F features, as in `exploring`.
"""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import State
from clearway.mapping.again import UNKNOWN
from clearway.mapping.beliefs import LatticePose
from clearway.mapping.charting import charted
from clearway.mapping.room_map import RoomMap
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.mapping.smoothing import smoothed
from clearway.mapping.walk import Walk

LONGEST_WALK = 500
"""Pictures whose poses are found together; it takes a second then, and grows with the cube of their number."""


def map_of(state: State, sight: Sight, settings: MappingSettings, row: int = 0) -> RoomMap:
    """What an explorer's state tells of the room of one of its tours.

    Where pictures do not repeat, poses that were held on the way may have been wrong; those of all pictures are found
    anew, together, and the map is made by them. After a walk longer than `LONGEST_WALK` it is as was held on the way.

    Args:
        state: at the end of B tours.
        sight, settings: the explorer's.
        row: of the tour.
    """
    walk = walk_of(state, row)
    if walk and (known := found_anew(walk, sight, settings)):
        return known
    count = int(state["count"][row])
    return RoomMap(state["room"][row], state["shut"][row], state["taken"][row, :count], state["features"][row, :count])


def walk_of(state: State, row: int, now: tuple[np.ndarray, LatticePose] | None = None) -> Walk | None:
    """The walk of a tour, and a picture (F,) `now`; None where pictures may repeat, and of one that is too long."""
    walked = int(state["walked"][row])
    if state["repeats"][row] >= UNKNOWN or walked > state["actions_walked"].shape[1]:
        return None
    features, action, held = (state[f"{name}_walked"][row, :walked] for name in ("features", "actions", "poses"))
    if now is not None:
        seen, pose = now
        features, action = np.concatenate([features, seen[None].astype(np.float16)]), np.append(action, 0)
        held = np.concatenate([held, np.array([pose.index])])
    return Walk(features, action, held) if len(features) else None


def found_anew(walk: Walk, sight: Sight, settings: MappingSettings, *, doubts: bool = False) -> RoomMap | None:
    """The map by all pictures of a walk; None off the lattice, and as of `smoothed`. `doubts`: as of `charted`."""
    poses = smoothed(walk, sight, settings)
    if poses is None or (poses[:, 1:] < 0).any() or (poses[:, 1:] >= settings.side).any():
        return None
    return charted(walk, poses, sight, settings, doubts=doubts)
