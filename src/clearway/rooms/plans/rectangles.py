"""Cutting a map into rectangles of cells: half-open boxes (i0, j0, i1, j1) of its two indices."""

from __future__ import annotations

import heapq
from itertools import pairwise

import numpy as np

Box = tuple[int, int, int, int]


def rectangles(marked: np.ndarray, widest: int) -> list[Box]:
    """Disjoint boxes that together cover the marked cells exactly, large ones first.

    Args:
        marked: (X, Z) bool.
        widest: cells across the shorter side of a box, at most.
    """
    left, boxes = marked.copy(), []
    queue = [(-_area(_largest_from(left, i, j, widest)), i, j) for i, j in np.argwhere(marked).tolist()]
    heapq.heapify(queue)
    while queue:
        promised, i, j = heapq.heappop(queue)
        if not left[i, j]:
            continue
        i0, j0, i1, j1 = box = _largest_from(left, i, j, widest)
        if _area(box) == -promised:
            left[i0:i1, j0:j1] = False
            boxes.append(box)
        else:  # part of it has been taken since
            heapq.heappush(queue, (-_area(box), i, j))
    return boxes


def _area(box: Box) -> int:
    i0, j0, i1, j1 = box
    return (i1 - i0) * (j1 - j0)


def _largest_from(left: np.ndarray, i: int, j: int, widest: int) -> Box:
    """The larger of two boxes with this first cell: grown along one index as far as it goes, then along the other."""
    along_first = _run(left[i:, j])
    along_second = _run(left[i, j:])
    across_second = _run(np.all(left[i : i + along_first, j : j + widest], axis=0))
    across_first = _run(np.all(left[i : i + widest, j : j + along_second], axis=1))
    if along_first * across_second > along_second * across_first:
        return i, j, i + along_first, j + across_second
    return i, j, i + across_first, j + along_second


def _run(flags: np.ndarray) -> int:
    """How many of (N,) flags are set before the first that is not."""
    return len(flags) if flags.all() else int(flags.argmin())


def cut(box: Box, shortest: int, longest: int, rng: np.random.Generator) -> list[Box]:
    """A box cut across its longer side into pieces of `shortest` to `longest` cells, where it is longer than that."""
    i0, j0, i1, j1 = box
    along_first = i1 - i0 >= j1 - j0
    start, end = (i0, i1) if along_first else (j0, j1)
    marks = [start]
    while end - marks[-1] > longest:
        most = max(shortest, min(longest, end - marks[-1] - shortest))
        marks.append(marks[-1] + int(rng.integers(shortest, most + 1)))
    marks.append(end)
    return [(a, j0, b, j1) if along_first else (i0, a, i1, b) for a, b in pairwise(marks)]
