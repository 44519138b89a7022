"""Pure functions on a scene's graph of poses: distances, components, the transition table.

A graph is (S, A) int32: the next state by action, -1 where the move is blocked and the agent stays.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, shortest_path

from clearway.scenes.actions import BLOCKED, Action

UNREACHABLE = -1


def next_states(graph: np.ndarray) -> np.ndarray:
    """Where each action leads, (S, A) int64: a blocked move leads back to its own state."""
    stay = np.arange(len(graph))[:, None]
    return np.where(graph == BLOCKED, stay, graph).astype(np.int64)


def adjacency(graph: np.ndarray) -> csr_array:
    """Sparse (S, S) float matrix with a 1 at (s, s') for every action that leads from s to s'."""
    state, action = np.nonzero(graph != BLOCKED)
    count = len(graph)
    return csr_array((np.ones(len(state)), (state, graph[state, action])), shape=(count, count))


def distances(graph: np.ndarray) -> np.ndarray:
    """Shortest-path distance from every state to every state, (S, S) int32 steps; -1 where there is no path."""
    steps = shortest_path(adjacency(graph), unweighted=True)
    return np.where(np.isfinite(steps), steps, UNREACHABLE).astype(np.int32)


def distances_to(graph: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Shortest-path distance of every state to each target, (len(targets), S) int32 steps; -1: no path.

    Costs one breadth-first search a target, so that large scenes need no (S, S) table.
    """
    steps = shortest_path(adjacency(graph).T.tocsr(), unweighted=True, indices=np.asarray(targets))
    return np.where(np.isfinite(steps), steps, UNREACHABLE).astype(np.int32)


def turn_circles(graph: np.ndarray) -> np.ndarray:
    """The circle of right turns that each state lies on, (S,) int64, numbered by first appearance.

    Right turns must be a permutation of the states.
    """
    count = len(graph)
    turned = csr_array((np.ones(count), (np.arange(count), graph[:, Action.TURN_RIGHT])), shape=(count, count))
    _, label = connected_components(turned, directed=False)
    _, first, circle = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[circle]


def components(graph: np.ndarray) -> np.ndarray:
    """Label of the strongly connected component of each state, (S,) int; 0 is the largest component."""
    _, labels = connected_components(adjacency(graph), directed=True, connection="strong")
    by_size = np.argsort(-np.bincount(labels), kind="stable")
    rank = np.empty_like(by_size)
    rank[by_size] = np.arange(len(by_size))
    return rank[labels]
