"""`RoomMap`: what is known of a room after a tour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class RoomMap:
    """A room on a lattice of G x G cells, N pictures of it.

    Attributes:
        room: (G, G) float32, log-odds that a body can stand in a cell.
        shut: (4, G, G) bool, a move out of a cell along a direction was blocked.
        taken: (N, 3) int64, heading, row and column of the pose of each picture.
        features: (N, F) float16, of the pictures.
    """

    room: np.ndarray
    shut: np.ndarray
    taken: np.ndarray
    features: np.ndarray
