"""The navigation grid of a world: where the agent fits, which moves are free, and the graph of its poses.

Coordinates: x is MuJoCo's x, and z (across the floor) is MuJoCo's y.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clearway.errors import SceneError
from clearway.rooms.obstacles import MARGIN_REACH_M, AgentShape, CollisionRoom, Obstacles, collision_model
from clearway.scenes.grid import HEADING_COUNT, connected_parts, edges_among, neighbour_pairs, pose_graph

SAME_PLACE_M = 1e-6


@dataclass(frozen=True)
class Floor:
    """A rectangle of floor, and a point of its grid: x and z, metres."""

    low_m: tuple[float, float]
    high_m: tuple[float, float]
    origin_m: tuple[float, float]


@dataclass(frozen=True, eq=False)
class NavigationGrid:
    """A connected part of a floor's free cells. C cells, E edges, S = 4 C states.

    State 4 c + h is cell c at a heading of 90 h degrees.

    Attributes:
        cells: (C, 2) int64, column along x and row along z on the grid; by x, then z.
        locations_m: (C, 2) float64, x and z of each cell.
        edges: (E, 2) int64, the pairs of neighbouring cells with a free move between them, lower cell first.
        graph: (S, A) int32, next state by action; -1 where the move is blocked.
        component_sizes: number of cells of every connected part, the largest first.
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
    """The navigation grid of a room for an agent (by default the capsule of the paper's setting): its largest part.

    Raises:
        SceneError: the agent fits nowhere in the room.
    """
    agent = agent or AgentShape()
    floor = Floor((0.0, 0.0), (room.width_m, room.depth_m), room.grid_origin_m)
    grid = grid_on_floor(floor, Obstacles(collision_model(room, agent), agent), agent)
    if grid is None:
        raise SceneError(
            room.name, "the agent fits nowhere in the room", "Give the room more free floor or another seed."
        )
    return grid


def grid_on_floor(
    floor: Floor,
    obstacles: Obstacles,
    agent: AgentShape,
    *,
    from_origin: bool = False,
    carries: Callable[[np.ndarray], np.ndarray] | None = None,
) -> NavigationGrid | None:
    """The navigation grid of a floor for an agent; None where there is no free cell to start from.

    Args:
        floor: beyond its edges the agent must not reach.
        obstacles: what stands on it.
        agent: its body.
        from_origin: keep the part that can be reached from the grid's origin instead of the largest.
        carries: whether there is something to stand on at each of (N, 2) points, (N,) bool; None: everywhere.
    """
    columns_m, rows_m = _grid_lines(floor, agent.step_m)
    points = np.stack(np.meshgrid(np.arange(len(columns_m)), np.arange(len(rows_m)), indexing="ij"), axis=-1)
    points = points.reshape(-1, 2)
    points_m = np.stack([columns_m[points[:, 0]], rows_m[points[:, 1]]], axis=-1)
    gaps_m = np.minimum(obstacles.standing_gaps_m(points_m), _edge_gaps_m(floor, points_m, agent.radius_m))
    free = gaps_m > agent.clearance_m
    if carries is not None:
        free[free] = carries(points_m[free])
    if not free.any():
        return None
    cells, locations_m = points[free], points_m[free]
    pairs, axes = neighbour_pairs(cells)
    middles_m = locations_m[pairs].mean(axis=1)
    move_gaps_m = obstacles.moving_gaps_m(middles_m, axes)
    passable = move_gaps_m > agent.clearance_m
    if carries is not None:
        passable[passable] = carries(middles_m[passable])
    edges = pairs[passable]

    component, sizes = connected_parts(len(cells), edges)
    kept = component == (_component_at(floor.origin_m, locations_m, component) if from_origin else 0)
    if not kept.any():
        return None
    edges = edges_among(kept, edges)
    margins_m = np.abs(np.concatenate([gaps_m, move_gaps_m]) - agent.clearance_m)
    return NavigationGrid(
        cells=cells[kept],
        locations_m=locations_m[kept],
        edges=edges,
        graph=pose_graph(cells[kept], edges),
        component_sizes=sizes,
        smallest_margin_m=float(min(margins_m.min(), MARGIN_REACH_M)),
    )


def _grid_lines(floor: Floor, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The x of the grid's columns and the z of its rows that lie on the floor, ascending."""
    lines = []
    for origin_m, low_m, high_m in zip(floor.origin_m, floor.low_m, floor.high_m, strict=True):
        first_m = low_m + round((origin_m - low_m) % step_m, 9)
        count = int(np.floor((high_m - first_m) / step_m + 1e-9)) + 1
        lines.append(first_m + step_m * np.arange(count))
    return lines[0], lines[1]


def _edge_gaps_m(floor: Floor, points_m: np.ndarray, radius_m: float) -> np.ndarray:
    """Gap between the agent at each of (N, 2) points and the nearest edge of the floor, (N,)."""
    return np.minimum(points_m - floor.low_m, floor.high_m - points_m).min(axis=1) - radius_m


def _component_at(place_m: tuple[float, float], locations_m: np.ndarray, component: np.ndarray) -> int:
    """The connected part that holds the cell at a place; -1 where no cell lies there."""
    here = np.abs(locations_m - place_m).max(axis=1) < SAME_PLACE_M
    return int(component[here][0]) if here.any() else -1
