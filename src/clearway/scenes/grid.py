"""Poses on a square grid: four headings a cell, and the graph that joins them. State 4 c + h is cell c at 90 h degrees.

Axis letters: C cells, E edges, S = 4 C states, A actions.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from clearway.scenes.actions import ACTION_COUNT, BLOCKED, Action

HEADING_COUNT = 4
HEADING_STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))  # (x, z) grid step of a move at 0, 90, 180, 270 degrees


def neighbour_pairs(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of neighbours among distinct cells (C, 2) int, and the axis along which each pair lies.

    Returns:
        pairs: (E, 2) int64, indices of cells, the one of smaller x or z first.
        axes: (E,) int64, 0 for x, 1 for z.
    """
    number = {(int(column), int(row)): index for index, (column, row) in enumerate(cells)}
    pairs, axes = [], []
    for (column, row), index in number.items():
        for axis, neighbour in enumerate(((column + 1, row), (column, row + 1))):
            if neighbour in number:
                pairs.append((index, number[neighbour]))
                axes.append(axis)
    return np.array(pairs, np.int64).reshape(-1, 2), np.array(axes, np.int64)


def connected_parts(count: int, edges: np.ndarray) -> tuple[np.ndarray, tuple[int, ...]]:
    """Connected part of each of `count` cells, (C,) with 0 the largest, and the sizes of the parts, descending."""
    links = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    _, labels = connected_components(links, directed=False)
    sizes = np.bincount(labels)
    by_size = np.argsort(-sizes, kind="stable")
    rank = np.empty_like(by_size)
    rank[by_size] = np.arange(len(by_size))
    return rank[labels], tuple(int(size) for size in sizes[by_size])


def edges_among(kept: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """The edges among kept cells, (C,) bool, by the cells' numbers among these; whole connected parts are kept."""
    number = np.cumsum(kept) - 1
    return number[edges[kept[edges[:, 0]]]]


def pose_graph(cells: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """The graph of poses, (4 C, A) int32, from (C, 2) grid cells and (E, 2) free moves between them."""
    neighbours = np.full((len(cells), HEADING_COUNT), BLOCKED)
    for near, far in (edges.T, edges.T[::-1]):
        for heading, step in enumerate(HEADING_STEPS):
            ahead = np.all(cells[far] - cells[near] == step, axis=1)
            neighbours[near[ahead], heading] = far[ahead]

    headings = np.arange(HEADING_COUNT)
    cell = np.arange(len(cells))[:, None]
    behind = np.roll(neighbours, 2, axis=1)
    graph = np.empty((len(cells), HEADING_COUNT, ACTION_COUNT), np.int32)
    graph[..., Action.MOVE_FORWARD] = np.where(neighbours == BLOCKED, BLOCKED, 4 * neighbours + headings)
    graph[..., Action.MOVE_BACKWARD] = np.where(behind == BLOCKED, BLOCKED, 4 * behind + headings)
    graph[..., Action.TURN_RIGHT] = 4 * cell + (headings + 1) % HEADING_COUNT
    graph[..., Action.TURN_LEFT] = 4 * cell + (headings - 1) % HEADING_COUNT
    return graph.reshape(-1, ACTION_COUNT)
