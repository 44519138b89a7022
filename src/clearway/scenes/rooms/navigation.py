"""The navigation grid of a room: where the agent fits, which moves are free, and the graph of its poses.

Coordinates: x is MuJoCo's x, and z (across the floor) is MuJoCo's y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from clearway.errors import SceneError
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.graph import distances
from clearway.scenes.grid import HEADING_COUNT, neighbour_pairs, pose_graph
from clearway.scenes.rooms.obstacles import MARGIN_REACH_M, AgentShape, CollisionRoom, Obstacles


@dataclass(frozen=True, eq=False)
class NavigationGrid:
    """The largest connected part of a room's free cells. C cells, E edges, S = 4 C states.

    State 4 c + h is cell c at a heading of 90 h degrees.

    Attributes:
        cells: (C, 2) int64, column along x and row along z on the grid; by x, then z.
        locations_m: (C, 2) float64, x and z of each cell.
        edges: (E, 2) int64, the pairs of neighbouring cells with a free move between them, lower cell first.
        graph: (S, A) int32, next state by action; -1 where the move is blocked.
        component_sizes: number of cells of every connected part, the largest (the kept one) first.
        smallest_margin_m: distance of the nearest decision (cell or move) to its threshold; at most 0.1.
    """

    cells: np.ndarray
    locations_m: np.ndarray
    edges: np.ndarray
    graph: np.ndarray
    component_sizes: tuple[int, ...]
    smallest_margin_m: float

    @property
    def state_locations_m(self) -> np.ndarray:
        """(S, 2) float64, x and z of every state."""
        return np.repeat(self.locations_m, HEADING_COUNT, axis=0)

    @property
    def state_headings_deg(self) -> np.ndarray:
        """(S,) int64 heading of every state: 0, 90, 180, 270, 0, ..."""
        return np.tile(np.arange(HEADING_COUNT) * 90, len(self.locations_m))


def find_grid(room: CollisionRoom, agent: AgentShape | None = None) -> NavigationGrid:
    """The navigation grid of a room for an agent (by default the capsule of the paper's setting).

    Raises:
        SceneError: the agent fits nowhere in the room.
    """
    agent = agent or AgentShape()
    obstacles = Obstacles(room, agent)
    columns_m, rows_m = _grid_lines(room, agent.step_m)
    points = np.stack(np.meshgrid(np.arange(len(columns_m)), np.arange(len(rows_m)), indexing="ij"), axis=-1)
    points = points.reshape(-1, 2)
    points_m = np.stack([columns_m[points[:, 0]], rows_m[points[:, 1]]], axis=-1)
    gaps_m = np.minimum(obstacles.standing_gaps_m(points_m), _wall_gaps_m(room, points_m, agent.radius_m))
    free = gaps_m > agent.clearance_m
    if not free.any():
        raise SceneError(
            room.name, "the agent fits nowhere in the room", "Give the room more free floor or another seed."
        )
    cells, locations_m = points[free], points_m[free]
    pairs, axes = neighbour_pairs(cells)
    move_gaps_m = obstacles.moving_gaps_m(locations_m[pairs].mean(axis=1), axes)
    edges = pairs[move_gaps_m > agent.clearance_m]

    component, sizes = _components(len(cells), edges)
    kept = component == 0
    number = np.cumsum(kept) - 1
    edges = number[edges[kept[edges[:, 0]]]]
    margins_m = np.abs(np.concatenate([gaps_m, move_gaps_m]) - agent.clearance_m)
    return NavigationGrid(
        cells=cells[kept],
        locations_m=locations_m[kept],
        edges=edges,
        graph=pose_graph(cells[kept], edges),
        component_sizes=sizes,
        smallest_margin_m=float(min(margins_m.min(), MARGIN_REACH_M)),
    )


def mean_degree(graph: np.ndarray) -> float:
    """Mean number of open neighbours of a cell, from a (4 C, A) graph of poses."""
    return float(np.mean(graph[:, Action.MOVE_FORWARD] != BLOCKED) * HEADING_COUNT)


def mean_shortest_path(graph: np.ndarray) -> float:
    """Mean steps of the shortest path over all ordered pairs of distinct states of a connected graph."""
    steps = distances(graph)
    assert (steps >= 0).all(), "the graph is not connected"
    return float(steps.sum() / (len(graph) * (len(graph) - 1)))


def _grid_lines(room: CollisionRoom, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The x of the grid's columns and the z of its rows that lie on the floor, ascending."""
    lines = []
    for origin_m, extent_m in zip(room.grid_origin_m, (room.width_m, room.depth_m), strict=True):
        first_m = round(origin_m % step_m, 9)
        count = int(np.floor((extent_m - first_m) / step_m + 1e-9)) + 1
        lines.append(first_m + step_m * np.arange(count))
    return lines[0], lines[1]


def _wall_gaps_m(room: CollisionRoom, points_m: np.ndarray, radius_m: float) -> np.ndarray:
    """Gap between the agent at each of (N, 2) points and the nearest edge of the floor, (N,)."""
    extent_m = np.array([room.width_m, room.depth_m])
    return np.minimum(points_m, extent_m - points_m).min(axis=1) - radius_m


def _components(count: int, edges: np.ndarray) -> tuple[np.ndarray, tuple[int, ...]]:
    """Connected part of each cell, (count,) with 0 the largest, and the sizes of the parts, descending."""
    links = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    _, labels = connected_components(links, directed=False)
    sizes = np.bincount(labels)
    by_size = np.argsort(-sizes, kind="stable")
    rank = np.empty_like(by_size)
    rank[by_size] = np.arange(len(by_size))
    return rank[labels], tuple(int(size) for size in sizes[by_size])
