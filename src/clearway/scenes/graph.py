"""Pure functions on a scene's graph of poses: distances, components, the transition table.

A graph is (S, A) int32: the next state by action, -1 where the move is blocked and the agent stays.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, shortest_path

from clearway.scenes.actions import BLOCKED, Action

UNREACHABLE = -1


def next_states(graph: np.ndarray) -> np.ndarray:
    """Where each action leads, (S, A) int64: a blocked move leads back to its own state."""
    stay = np.arange(len(graph))[:, None]
    return np.where(graph == BLOCKED, stay, graph).astype(np.int64)


def adjacency(graph: np.ndarray) -> csr_array:
    """Sparse (S, S) float matrix with a 1 at (s, s') for every state s' that an action leads to from s."""
    ahead = np.sort(graph, axis=1)
    is_open = ahead != BLOCKED
    is_open[:, 1:] &= ahead[:, 1:] != ahead[:, :-1]  # each once: SciPy's search for components hangs on two
    first = np.concatenate([[0], np.cumsum(np.count_nonzero(is_open, axis=1))])
    leads_to = ahead[is_open]  # in the order of rows, as compressed ones are kept
    return csr_array((np.ones(len(leads_to)), leads_to, first), shape=(len(graph), len(graph)))


def distances(graph: np.ndarray) -> np.ndarray:
    """Shortest-path distance from every state to every state, (S, S) int32 steps; -1 where there is no path."""
    steps = shortest_path(adjacency(graph), unweighted=True)
    return np.where(np.isfinite(steps), steps, UNREACHABLE).astype(np.int32)


def distances_to(graph: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Shortest-path distance of every state to each target, (len(targets), S) int32 steps; -1: no path.

    Costs one breadth-first search a target, so that large scenes need no (S, S) table.
    """
    backwards = adjacency(graph).T.tocsr()
    steps = [_depths(breadth_first_order(backwards, int(target))[1], int(target)) for target in np.asarray(targets)]
    return np.array(steps, np.int32).reshape(-1, len(graph))


def _depths(before: np.ndarray, root: int) -> np.ndarray:
    """Depth of each node in a tree, (S,) int32, from the node before it, (S,) int; -1 where that is negative.

    Every round each node looks twice as far up.
    """
    outside = before < 0
    outside[root] = False
    above = np.where(before < 0, root, before).astype(np.int64)
    depth = np.ones(len(before), np.int32)
    depth[root] = 0
    while (further := depth[above]).any():
        depth += further
        above = above[above]
    depth[outside] = UNREACHABLE
    return depth


def turn_circles(graph: np.ndarray) -> np.ndarray:
    """The circle of right turns that each state lies on, (S,) int64, numbered by first appearance.

    Right turns must be a permutation of the states.
    """
    states = np.arange(len(graph))
    least, onward = states, graph[:, Action.TURN_RIGHT]  # least state within 1, 2, 4, ... turns, and where those lead
    while (less := np.minimum(least, least[onward])).tobytes() != least.tobytes():
        least, onward = less, onward[onward]
    return (np.cumsum(least == states) - 1)[least]


def components(graph: np.ndarray) -> np.ndarray:
    """Label of the strongly connected component of each state, (S,) int; 0 is the largest component."""
    _, labels = connected_components(adjacency(graph), directed=True, connection="strong")
    by_size = np.argsort(-np.bincount(labels), kind="stable")
    rank = np.empty_like(by_size)
    rank[by_size] = np.arange(len(by_size))
    return rank[labels]
