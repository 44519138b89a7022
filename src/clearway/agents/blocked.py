"""What an episode has seen to be blocked: a move after which the very same picture came again.

Pictures are told apart by marks (`mapping.again`). Where pictures never repeat, nothing is ever held for blocked. Where
two poses show the same picture, what was blocked in one is not tried in the other; so an agent that knows no other way
out keeps its probabilities, and the oldest pictures are forgotten.

Axis letters: B episodes, A actions, K pictures that are remembered, the last ones.
"""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import State
from clearway.scenes.actions import ACTION_COUNT, MOVES

PICTURES = 64  # K
_MARK, _BLOCKED = "blocked mark", "blocked moves"
_IS_MOVE = np.isin(np.arange(ACTION_COUNT), MOVES)


def nothing_blocked(count: int) -> State:
    """The part of a state that is begun with, of so many episodes."""
    return {_MARK: np.zeros((count, PICTURES), np.uint32), _BLOCKED: np.zeros((count, PICTURES, ACTION_COUNT), bool)}


def add_blocked(state: State, mark: np.ndarray, action: np.ndarray, blocked: np.ndarray) -> State:
    """The same part after the last actions (B,), by marks (B,) of what is seen, where nothing changed (B,) bool."""
    marks, moves = state[_MARK].copy(), state[_BLOCKED].copy()
    for row in np.flatnonzero(blocked & _IS_MOVE[action]):
        found = np.flatnonzero(marks[row] == mark[row])
        if not len(found):  # the oldest makes room
            marks[row], moves[row] = np.roll(marks[row], 1), np.roll(moves[row], 1, axis=0)
            marks[row, 0], moves[row, 0], found = mark[row], False, np.zeros(1, int)
        moves[row, found[0], action[row]] = True
    return {_MARK: marks, _BLOCKED: moves}


def without_blocked(state: State, mark: np.ndarray, probabilities: np.ndarray) -> np.ndarray:
    """Probabilities (B, A) with none for what was blocked where the same was seen, marks (B,).

    Rows in which nothing was stay as they are, and so do those that have nothing else.
    """
    here = state[_MARK] == mark[:, None]
    shut = (state[_BLOCKED] & here[:, :, None]).any(axis=1)
    left = np.where(shut, 0.0, probabilities)
    total = left.sum(axis=1, keepdims=True)
    return np.divide(left, total, out=probabilities.copy(), where=(total > 0) & shut.any(axis=1, keepdims=True))
