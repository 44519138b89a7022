"""The map that a walk makes, where its pictures were taken in known poses."""

from __future__ import annotations

import numpy as np

from clearway.mapping.beliefs import LatticePose, add_standing
from clearway.mapping.following import BUMPED, SURE
from clearway.mapping.lattice import AHEAD, HEADINGS
from clearway.mapping.room_map import RoomMap
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.mapping.walk import Walk

FREE = 2.0  # log-odds from which on eyes take a cell for free


def charted(walk: Walk, poses: np.ndarray, sight: Sight, settings: MappingSettings, *, doubts: bool = False) -> RoomMap:
    """The map.

    A pose that was come to often tells of the cells around it once, by the mean of its pictures. A way is shut where a
    move was blocked and none went through.

    Args:
        walk: T pictures.
        poses: (T, 3) int64, heading, row and column of each, inside the lattice.
        sight, settings: as of `Follower`.
        doubts: ways are left open into cells that eyes take for free.
    """
    side = settings.side
    room = np.full((side, side), settings.usual_room, np.float32)
    stands = sight.stands(walk.features.astype(np.float32))
    distinct, which = np.unique(poses, axis=0, return_inverse=True)
    for number, pose in enumerate(distinct.tolist()):
        told = stands[which.ravel() == number].mean(axis=0)
        add_standing(room, LatticePose(*pose), told, settings.standing_weight, settings.lattice)
    shut, open_ = np.zeros((HEADINGS, side, side), bool), np.zeros((HEADINGS, side, side), bool)
    by_eyes = room.copy()
    for before, step, gone in zip(poses[:-1], walk.step[1:], np.diff(poses[:, 1:], axis=0), strict=True):
        if step.any():
            way, beyond = (_direction(step), *before[1:]), tuple(np.clip(before[1:] + step, 0, side - 1))
            if gone.any():
                open_[way] = True
            elif not (doubts and by_eyes[beyond] > FREE):
                shut[way] = True
                room[beyond] -= BUMPED
    room[poses[:, 1], poses[:, 2]] = SURE
    return RoomMap(np.clip(room, -SURE, SURE), shut & ~open_, poses, walk.features)


def _direction(step: np.ndarray) -> int:
    """Of a step (2,) on the lattice."""
    return int((step == AHEAD).all(axis=1).argmax())
