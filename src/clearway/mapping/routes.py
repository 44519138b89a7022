"""The cheapest ways over the lattice: turns cost a step, moves a step and what entering a cell may cost besides.

Axes: B lattices, 4 headings, G rows, G columns.
"""

from __future__ import annotations

import numpy as np

from clearway.mapping.beliefs import LatticePose
from clearway.mapping.lattice import AHEAD, HEADINGS
from clearway.scenes.actions import Action

FAR = 1e4


def shifted(values: np.ndarray, step: np.ndarray, fill: float) -> np.ndarray:
    """Values (..., G, G) moved by a step (2,) of rows and columns; what comes in from outside is `fill`."""
    rows, columns = step.tolist()
    moved = np.full_like(values, fill)
    side = values.shape[-1]
    to_rows, from_rows = _overlap(rows, values.shape[-2])
    to_columns, from_columns = _overlap(columns, side)
    moved[..., to_rows, to_columns] = values[..., from_rows, from_columns]
    return moved


def _overlap(by: int, side: int) -> tuple[slice, slice]:
    return slice(max(0, by), side + min(0, by)), slice(max(0, -by), side - max(0, by))


def ways_from(start: np.ndarray, entering: np.ndarray, most: int = 400) -> np.ndarray:
    """(B, 4, G, G) float32, costs of the cheapest ways from poses.

    Args:
        start: (B, 4, G, G) costs to begin with: 0 in the start, `FAR` elsewhere.
        entering: (B, 4, G, G) float32, cost of entering each cell by a move along each of the four directions.
        most: sweeps.
    """
    cost = start.astype(np.float32)
    for _ in range(most):
        better = np.minimum(cost, np.minimum(cost[:, [3, 0, 1, 2]], cost[:, [1, 2, 3, 0]]) + 1)
        for heading in range(HEADINGS):
            back = (heading + 2) % HEADINGS
            ahead = shifted(cost[:, heading], AHEAD[heading], FAR) + entering[:, heading]
            behind = shifted(cost[:, heading], AHEAD[back], FAR) + entering[:, back]
            better[:, heading] = np.minimum(better[:, heading], np.minimum(ahead, behind))
        if (better >= cost - 1e-4).all():
            return better
        cost = better
    return cost


def first_action(start: LatticePose, end: LatticePose, cost: np.ndarray, entering: np.ndarray) -> int:
    """The first action of a cheapest way.

    Args:
        start, end: of the way; where they are the same, the agent turns.
        cost: (4, G, G) of the ways from the start, by `ways_from`.
        entering: (4, G, G), that they were found by.
    """
    pose, action, side = end, Action.TURN_RIGHT, cost.shape[-1]
    while pose != start:
        into = float(entering[pose.index])
        backwards = float(entering[pose.turned(2).index])
        steps = (
            (Action.MOVE_FORWARD, pose.moved(-1), into),
            (Action.TURN_RIGHT, pose.turned(-1), 1.0),
            (Action.TURN_LEFT, pose.turned(1), 1.0),
            (Action.MOVE_BACKWARD, pose.moved(1), backwards),
        )
        inside = [step for step in steps if 0 <= step[1].row < side and 0 <= step[1].column < side]
        action, pose, _ = min(inside, key=lambda step: float(cost[step[1].index]) + step[2])
    return int(action)
