"""Where the pictures of a walk were taken, by all of them together.

On the way an agent holds one pose for the likeliest, by what it has seen so far. Afterwards later pictures tell of
earlier ones, too: this is smoothing, as in full simultaneous localisation and mapping (Lu & Milios 1997; Thrun, Burgard
& Fox 2005). Where turns are exact, a walk is told by which of its moves were blocked. Where they are not, errors add
up, and what was held on the way, which follows the pictures, may be nearer to the truth: the pictures decide.

Axis letters: T pictures, P pairs of them, W cells along a side of the window around a pose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clearway.mapping.following import LATEST
from clearway.mapping.lattice import AHEAD
from clearway.mapping.moves import evidence_for_moves
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.mapping.walk import Walk
from clearway.perception.whereabouts import ELSEWHERE

LEAST = -4.0
"""Evidence, at least, that two pictures were taken as they are held to be: eyes err in places that look alike."""
WORTH = 0.5  # evidence that a change must bring
LIKELIER = 0.1  # share of evidence by which poses held on the way must have more
MOST_CHANGES = 200  # then the poses are taken as they are


@dataclass(frozen=True, eq=False)
class _Pairs:
    """What eyes tell of pairs of pictures.

    Attributes:
        first, second: (P,) int64, numbers of the pictures, the earlier one first.
        told: (P, W, W), evidence by rows and columns from the first pose to the second.
    """

    first: np.ndarray
    second: np.ndarray
    told: np.ndarray

    def along(self, way: np.ndarray) -> np.ndarray:
        """(P,) evidence of pictures with these rows and columns (T, 2)."""
        return self.at(way[self.second] - way[self.first])

    def at(self, apart: np.ndarray) -> np.ndarray:
        """(P,) evidence where the second poses are so many rows and columns (P, 2) from the first; 0 out of sight."""
        reach = self.told.shape[1] // 2
        inside = (np.abs(apart) <= reach).all(axis=1)
        row, column = (np.clip(apart, -reach, reach) + reach).T
        return np.where(inside, self.told[np.arange(len(self.told)), row, column], 0.0)


def smoothed(walk: Walk, sight: Sight, settings: MappingSettings) -> np.ndarray | None:
    """(T, 3) int64, heading, row and column of each picture's likeliest pose; None where those held are clearly so.

    It begins with what is told of each move by itself. Then that part of the walk is shifted by a cell, as the moves at
    its ends allow, which brings most evidence, until none brings any.

    Args:
        walk: at least one picture.
        sight: compares them.
        settings: what answers count for; each picture is compared with so many as are `compared`.
    """
    moves = evidence_for_moves(walk, sight, settings)
    compared = _compared(walk, sight, settings)
    pairs = _pairs(*compared, walk.heading, settings)
    moved = moves > 0
    for _ in range(MOST_CHANGES):
        changed = _best_change(walk, moves, moved, pairs)
        if not changed:
            break
        moved[changed] ^= True
    way = _way(walk, moved)
    held = _pairs(*compared, walk.held[:, 0], settings).along(walk.held[:, 1:])
    if _clearly_more(held.sum(), pairs.along(way).sum()):
        return None
    return np.column_stack([walk.heading, way + settings.side // 2])


def _clearly_more(evidence: float, than: float) -> bool:
    """By `LIKELIER` of the other, which may be negative."""
    return evidence - than > LIKELIER * abs(than)


def _way(walk: Walk, moved: np.ndarray) -> np.ndarray:
    """(T, 2) rows and columns from the first picture, where those moves (T,) bool were not blocked."""
    return np.cumsum(walk.step * moved[:, None], axis=0)


def _compared(walk: Walk, sight: Sight, settings: MappingSettings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First and second (P,) pictures, and evidence (P, ELSEWHERE) of their poses: each with those most alike.

    But for its neighbours in time, which share the errors of moves.
    """
    seen = walk.features.astype(np.float32)
    number, described = np.arange(len(seen)), sight.description(seen)
    alike = described @ described.T
    alike[np.abs(number[:, None] - number) <= LATEST] = -np.inf
    nearest = np.argsort(-alike, axis=1, kind="stable")[:, : settings.compared]
    one, other = np.repeat(number, nearest.shape[1]), nearest.ravel()
    kept = np.isfinite(alike[one, other])
    first, second = np.unique(np.sort(np.stack([one, other])[:, kept], axis=0), axis=1)
    if not len(first):
        return first, second, np.zeros((0, ELSEWHERE), np.float32)
    return first, second, sight.whereabouts(seen[first], seen[second])


def _pairs(
    first: np.ndarray, second: np.ndarray, evidence: np.ndarray, heading: np.ndarray, settings: MappingSettings
) -> _Pairs:
    """What is told of pictures (P,) by evidence (P, ELSEWHERE), with headings (T,) on the lattice."""
    window = settings.lattice.window[heading[first], :, heading[second]]
    told = (
        np.take_along_axis(evidence, window.reshape(len(first), math.prod(window.shape[1:])), axis=1)
        .reshape(window.shape)
        .mean(axis=1)
    )
    half = settings.place_weight / 2  # what is told of a pair was told of both pictures
    return _Pairs(first, second, half * np.maximum(told, LEAST))


def _best_change(walk: Walk, moves: np.ndarray, moved: np.ndarray, pairs: _Pairs) -> list[int]:
    """Which moves (at most two) are to be held for what they were not; none where nothing is worth it.

    Args:
        moves: (T,), evidence that each move went through; 0 of what is none.
        moved: (T,) bool, what is held.
    """
    count, way = len(moved), _way(walk, moved)
    apart = way[pairs.second] - way[pairs.first]
    now, best, found = pairs.at(apart), WORTH, []
    for shift in AHEAD:
        into, out = (_summed(pairs, pairs.at(apart + sign * shift) - now, count) for sign in (1, -1))
        # pictures a to b - 1 are shifted: pairs with an earlier one, then with a later one
        earlier = into - np.diagonal(into)[:, None]
        later = out[:, -1] - out[:, -1][:, None] - np.diagonal(out) + out
        begins, ends = (_if_changed(walk.step, moves, moved, sign * shift) for sign in (1, -1))
        gain = np.triu(earlier + later, 1)[:count] + begins[:, None] + np.append(ends, 0.0)
        gain[np.tril_indices(count, 0, count + 1)] = -np.inf
        first, last = np.unravel_index(int(gain.argmax()), gain.shape)
        if gain[first, last] > best:
            best, found = float(gain[first, last]), [int(first), int(last)]
    return [number for number in found if number < count]


def _summed(pairs: _Pairs, values: np.ndarray, count: int) -> np.ndarray:
    """(T + 1, T + 1): at [a, b] the sum of values (P,) of pairs with a first picture before a, a second before b."""
    table = np.zeros((count + 1, count + 1))
    np.add.at(table, (pairs.first + 1, pairs.second + 1), values)
    return table.cumsum(axis=0).cumsum(axis=1)


def _if_changed(step: np.ndarray, moves: np.ndarray, moved: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """(T,) evidence that a change of each move brings which shifts all that follows so; -inf where none does."""
    went, came = ((step == sign * shift).all(axis=1) for sign in (1, -1))
    return np.where(went & ~moved, moves, np.where(came & moved, -moves, -np.inf))
