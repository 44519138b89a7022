"""Clearance: how far every pose is from the nearest obstacle, by the grid alone.

A blocked move says that the cell it would lead to is occupied, at least in part. The distance is taken to that cell's
near side: half a cell where a neighbour is blocked, and so on outwards. Off the grid distances are measured instead.
"""

from __future__ import annotations

import numpy as np

from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Scene


def scene_clearance_m(scene: Scene) -> np.ndarray:
    """Distance of each pose's location to the nearest blocked cell, (S,) float64 metres; inf where none is."""
    from scipy.spatial import cKDTree

    turn = np.deg2rad(scene.headings_deg)
    ahead_m = scene.cell_size_m * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    places_m = [
        (scene.locations_m + sign * ahead_m)[scene.graph[:, action] == BLOCKED]
        for action, sign in ((Action.MOVE_FORWARD, 1), (Action.MOVE_BACKWARD, -1))
    ]
    blocked_m = np.concatenate(places_m)
    if not len(blocked_m):
        return np.full(scene.state_count, np.inf)
    distinct_m, place = _distinct_places(scene)
    distance_m, _ = cKDTree(blocked_m).query(distinct_m)
    return np.maximum(distance_m - scene.cell_size_m / 2, 0.0)[place]


def _distinct_places(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Locations (L, 2) metres, and the one of each pose, (S,): one a cell, unless poses of a cell lie apart."""
    _, first = np.unique(scene.cells, return_index=True)
    one_a_cell = scene.locations_m[first]
    if np.array_equal(one_a_cell[scene.cells], scene.locations_m):
        return one_a_cell, scene.cells
    return scene.locations_m, np.arange(scene.state_count)
