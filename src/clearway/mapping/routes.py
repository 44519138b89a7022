"""The cheapest ways over the lattice: turns cost a step, moves a step and what entering a cell may cost besides.

Axes: B lattices, 4 headings, G rows, G columns; of prices of moves, 2: ahead, backwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

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


def ways_from(poses: Sequence[LatticePose], entering: np.ndarray) -> np.ndarray:
    """(B, 4, G, G) float32, costs of the cheapest ways from a pose of each lattice; `FAR` where there is none.

    Args:
        poses: B, where the ways begin.
        entering: (B, 2, 4, G, G) float32, cost of entering each cell by a move, ahead or backwards, that leads along
            each of the four directions; `FAR` where that is impossible.
    """
    first, after, price = _steps(entering.shape[-1])
    shape = entering.shape[2:]
    cost = np.empty((len(poses), math.prod(shape)), np.float32)
    for row, pose in enumerate(poses):
        prices = np.append(entering[row].ravel(), np.float32(1))[price]
        steps = csr_array((prices, after, first), shape=(cost.shape[1], cost.shape[1]))
        start = int(np.ravel_multi_index(pose.index, shape))
        (found,) = dijkstra(steps, indices=[start], limit=FAR)
        cost[row] = np.minimum(found, FAR)
    return cost.reshape(len(poses), *shape)


@cache
def _steps(side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The steps of a lattice as a sparse matrix: row starts, the poses after, and where their prices stand.

    Prices are those of entering cells, (2, 4, G, G), in one row; behind them the price of a turn.
    """
    shape = (HEADINGS, side, side)
    poses = np.arange(HEADINGS * side * side).reshape(shape)
    turn = np.full(shape, 2 * poses.size)
    beyond = [(np.roll(poses, -quarters, axis=0), turn) for quarters in (1, -1)]
    for move, away in enumerate((0, 2)):  # ahead, and backwards with the same heading
        directions = [(heading + away) % HEADINGS for heading in range(HEADINGS)]
        after = np.stack([shifted(poses[h], -AHEAD[d], -1) for h, d in enumerate(directions)])
        entered = np.stack([shifted(poses[d], -AHEAD[d], -1) for d in directions])
        beyond.append((after, entered + move * poses.size))
    after, price = (np.stack([step[part] for step in beyond], axis=-1).reshape(-1, len(beyond)) for part in (0, 1))
    inside = after >= 0
    first = np.concatenate([[0], inside.sum(axis=1).cumsum()])
    return first.astype(np.int32), after[inside].astype(np.int32), price[inside]


def first_action(start: LatticePose, end: LatticePose, cost: np.ndarray, entering: np.ndarray) -> int:
    """The first action of a cheapest way.

    Args:
        start, end: of the way; where they are the same, the agent turns.
        cost: (4, G, G) of the ways from the start, by `ways_from`.
        entering: (2, 4, G, G), that they were found by.
    """
    pose, action, side = end, Action.TURN_RIGHT, cost.shape[-1]
    while pose != start:
        into = float(entering[0][pose.index])
        backwards = float(entering[1][pose.turned(2).index])
        steps = (
            (Action.MOVE_FORWARD, pose.moved(-1), into),
            (Action.TURN_RIGHT, pose.turned(-1), 1.0),
            (Action.TURN_LEFT, pose.turned(1), 1.0),
            (Action.MOVE_BACKWARD, pose.moved(1), backwards),
        )
        inside = [step for step in steps if 0 <= step[1].row < side and 0 <= step[1].column < side]
        action, pose, _ = min(inside, key=lambda step: float(cost[step[1].index]) + step[2])
    return int(action)
