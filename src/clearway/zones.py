"""Zones: how near to a collision every pose is (paper, section 3.2, "Reward").

Pose level, the default:

- collision: moving forward or backward is blocked;
- precollision: not collision, and one forward or backward move leads into a collision pose;
- free: all other poses.

The cell level asks the same of a cell's poses together: a cell is in the collision zone when any of its headings is.
The target comes before all zones; that is the reward's business (`clearway.reward`), since it depends on the episode.
"""

from __future__ import annotations

from enum import IntEnum
from typing import get_args

import numpy as np

from clearway.choices import ZoneLevel
from clearway.errors import ClearwayError
from clearway.scenes.actions import BLOCKED, MOVES
from clearway.scenes.graph import next_states
from clearway.scenes.scene import Scene


class Zone(IntEnum):
    """Zone of a pose."""

    FREE = 0
    PRECOLLISION = 1
    COLLISION = 2


ZONE_COUNT = len(Zone)
ZONE_NAMES = tuple(zone.name.lower() for zone in Zone)


def pose_zones(graph: np.ndarray) -> np.ndarray:
    """Zone of each pose by its own moves, (S,) int8, from a graph (S, A) with -1 where a move is blocked."""
    collision = (graph[:, MOVES] == BLOCKED).any(1)
    return _combine(collision, _leads_into(graph, collision))


def cell_zones(graph: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Zone of each pose by the moves of all headings of its cell, (S,) int8; cells: (S,) int, cell of each state."""
    collision = _any_of_cell((graph[:, MOVES] == BLOCKED).any(1), cells)
    return _combine(collision, _any_of_cell(_leads_into(graph, collision), cells))


def scene_zones(scene: Scene, level: ZoneLevel = "pose") -> np.ndarray:
    """Zone of each pose of a scene, (S,) int8.

    Raises:
        ClearwayError: there is no such level.
    """
    if level not in get_args(ZoneLevel):
        raise ClearwayError(f"zone_level={level!r} is unknown. Use one of {', '.join(map(repr, get_args(ZoneLevel)))}")
    return pose_zones(scene.graph) if level == "pose" else cell_zones(scene.graph, scene.cells)


def _leads_into(graph: np.ndarray, marked: np.ndarray) -> np.ndarray:
    """(S,) bool: one forward or backward move ends in a marked pose."""
    return marked[next_states(graph)[:, MOVES]].any(1)


def _any_of_cell(marked: np.ndarray, cells: np.ndarray) -> np.ndarray:
    count = np.bincount(cells, weights=marked)
    return count[cells] > 0


def _combine(collision: np.ndarray, before_collision: np.ndarray) -> np.ndarray:
    near = np.where(before_collision, Zone.PRECOLLISION, Zone.FREE)
    return np.where(collision, Zone.COLLISION, near).astype(np.int8)


def zone_counts(zones: np.ndarray) -> dict[str, int]:
    """Number of poses in each zone by its name, from zones (S,)."""
    return {name: int((zones == zone).sum()) for zone, name in enumerate(ZONE_NAMES)}
