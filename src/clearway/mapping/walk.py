"""`Walk`: what was seen and done on a walk through a room, in order.

Axis letters: T pictures, F features.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clearway.mapping.lattice import AHEAD, HEADINGS
from clearway.scenes.actions import Action

STEPS = {Action.MOVE_FORWARD: 1, Action.MOVE_BACKWARD: -1}
QUARTERS = {Action.TURN_RIGHT: 1, Action.TURN_LEFT: -1}


@dataclass(frozen=True, eq=False)
class Walk:
    """A walk, which began in the middle of a lattice.

    Attributes:
        features: (T, F) float16, of its pictures.
        action: (T,) int64, what was done after each; what came of the last is not known.
        held: (T, 3) int64, heading, row and column of the pose in which each was held to be taken, on the way.
    """

    features: np.ndarray
    action: np.ndarray
    held: np.ndarray

    @cached_property
    def heading(self) -> np.ndarray:
        """(T,) int64, of each picture on the lattice, where turns are exact: they are never blocked."""
        turned = [QUARTERS.get(Action(action), 0) for action in self.action[:-1].tolist()]
        return np.concatenate([[0], np.cumsum(turned)]).astype(np.int64) % HEADINGS

    @cached_property
    def step(self) -> np.ndarray:
        """(T, 2) int64, rows and columns by which the move before each picture led on, unless it was blocked."""
        moved = [0, *(STEPS.get(Action(action), 0) for action in self.action[:-1].tolist())]
        return AHEAD[self.heading] * np.array(moved)[:, None]
