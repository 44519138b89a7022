"""The graph of poses that were recorded one by one: which pose a turn or a move leads to.

Axis letters: S poses, L locations, H headings, E blocked edges, A actions.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from clearway.errors import SceneError
from clearway.scenes.actions import ACTION_COUNT, BLOCKED, Action

SAME_PLACE_M = 1e-3  # locations closer than this are one
MOST_NEAR = 100  # locations so close to one, itself included, on average; each heading may tell it a little otherwise
REACH = 0.1  # a move ends at a location no farther from where it should end than this share of a step
HEADING_TOLERANCE_DEG = 1.0
STEP = "Give the distance of neighbouring locations as the step, and headings along which they lie"


def recorded_pose_graph(
    locations_m: np.ndarray,
    headings_deg: np.ndarray,
    step_m: float,
    *,
    blocked_edges: np.ndarray | None = None,
    source: str | Path,
    blocked_source: str | Path | None = None,
) -> np.ndarray:
    """The graph of recorded poses, (S, A) int32; -1 where a move is blocked.

    Every location must have the same evenly spaced headings. A move is free where there is a location one step along
    the heading (or against it), unless its edge is blocked.

    Args:
        locations_m: (S, 2) x and z.
        headings_deg: (S,).
        step_m: length of a move.
        blocked_edges: (E, 2, 2) pairs of locations, x and z of each, without a way between them.
        source: file that errors name.
        blocked_source: file that errors of blocked edges name; by default `source`.

    Raises:
        SceneError: a pose stands twice, far too many lie at one place, a location lacks a heading, no location lies a
            step from another, or a blocked edge is none.
    """
    places, location = _grouped(locations_m, source)
    pose = _poses(location, headings_deg, places, source)  # (L, H)
    heading_count = pose.shape[1]
    turn = np.deg2rad(np.arange(heading_count) * 360 / heading_count + headings_deg[pose[0, 0]])
    ahead_m = step_m * np.stack([np.sin(turn), np.cos(turn)], axis=1)  # (H, 2)
    neighbour = _neighbours(places, ahead_m, step_m)  # (L, H)
    behind = _neighbours(places, -ahead_m, step_m)
    if (neighbour == BLOCKED).all() and (behind == BLOCKED).all():
        raise SceneError(source, f"no move of {step_m:g} m leads from one location to another{_nearest(places)}", STEP)
    blocked = _blocked_ways(places, neighbour, behind, blocked_edges, blocked_source or source)
    graph = np.full((len(location), ACTION_COUNT), BLOCKED, np.int32)
    graph[pose, Action.TURN_RIGHT] = np.roll(pose, -1, axis=1)
    graph[pose, Action.TURN_LEFT] = np.roll(pose, 1, axis=1)
    column = np.arange(heading_count)
    for action, ends in ((Action.MOVE_FORWARD, neighbour), (Action.MOVE_BACKWARD, behind)):
        ways = np.arange(len(places))[:, None] * len(places) + ends
        free = (ends != BLOCKED) & ~np.isin(ways, blocked)
        graph[pose, action] = np.where(free, pose[ends, column], BLOCKED)
    return graph


def _grouped(locations_m: np.ndarray, source: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Distinct locations (L, 2), in order of first appearance, and the one of each pose, (S,).

    Raises:
        SceneError: so many lie so close that their pairs would not fit into memory.
    """
    given, spot = np.unique(locations_m, axis=0, return_inverse=True)
    tree = KDTree(given)
    if tree.count_neighbors(tree, SAME_PLACE_M) > MOST_NEAR * len(given):
        problem = f"on average more than {MOST_NEAR} locations lie within {SAME_PLACE_M:g} m of a location"
        raise SceneError(source, problem, "Give every pose once, in metres")
    pairs = tree.query_pairs(SAME_PLACE_M, output_type="ndarray")
    near = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(given), len(given)))
    _, place = connected_components(near, directed=False)
    _, first, group = np.unique(place[spot.reshape(-1)], return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return locations_m[first[order]], rank[group.reshape(-1)]


def _poses(location: np.ndarray, headings_deg: np.ndarray, places: np.ndarray, source: str | Path) -> np.ndarray:
    """The pose of each location and heading, (L, H); headings ascend from the smallest of the first location."""
    counts = np.bincount(location)
    heading_count = int(np.bincount(counts).argmax())
    first_deg = headings_deg[location == 0].min() % (360 / heading_count)
    turns = ((headings_deg - first_deg) % 360) * heading_count / 360
    column = np.round(turns).astype(np.int64) % heading_count
    off_deg = np.abs(turns - np.round(turns)) * 360 / heading_count
    spaced = f"{360 / heading_count:g} degrees apart from {first_deg:g}"
    odd = np.flatnonzero(off_deg > HEADING_TOLERANCE_DEG)
    if len(odd):
        where = _at(places[location[odd[0]]])
        problem = f"pose {odd[0]} at {where} has heading {headings_deg[odd[0]]:g}, expected headings {spaced}"
        raise SceneError(source, problem, "Record every location with the same evenly spaced headings")
    pose = np.full((len(places), heading_count), -1)
    for index, (place, heading) in enumerate(zip(location.tolist(), column.tolist(), strict=True)):
        if pose[place, heading] >= 0:
            problem = f"poses {pose[place, heading]} and {index} are the same: {_at(places[place])}"
            raise SceneError(source, f"{problem}, heading {headings_deg[index]:g}", "Give every pose once")
        pose[place, heading] = index
    missing = np.argwhere(pose < 0)
    if len(missing):
        place, heading = missing[0]
        wanted_deg = first_deg + heading * 360 / heading_count
        problem = f"the location {_at(places[place])} lacks the heading {wanted_deg:g} ({heading_count} are {spaced})"
        raise SceneError(source, problem, "Add it, or remove the location")
    return pose


def _neighbours(places: np.ndarray, ahead_m: np.ndarray, step_m: float) -> np.ndarray:
    """The location that a move ends at by location and heading, (L, H); -1 for none."""
    far, nearest = KDTree(places).query(places[:, None] + ahead_m, distance_upper_bound=REACH * step_m)
    return np.where(np.isfinite(far), nearest, BLOCKED)


def _nearest(places: np.ndarray) -> str:
    """How far the two nearest locations are apart, the end of a sentence."""
    if len(places) == 1:
        return "; there is only one"
    apart_m = np.asarray(KDTree(places).query(places, k=2)[0])[:, 1]
    return f"; the nearest two are {apart_m.min():g} m apart"


def _blocked_ways(
    places: np.ndarray,
    neighbour: np.ndarray,
    behind: np.ndarray,
    blocked_edges: np.ndarray | None,
    source: str | Path,
) -> np.ndarray:
    """Ways that are blocked, (2 E,) as from * L + to, both ways round."""
    if blocked_edges is None or not len(blocked_edges):
        return np.empty(0, np.int64)
    gap_m, nearest = KDTree(places).query(blocked_edges.astype(np.float64), distance_upper_bound=SAME_PLACE_M)
    ends = np.asarray(nearest, np.int64)
    for edge, (near, far), known in zip(blocked_edges, ends.tolist(), np.isfinite(gap_m).tolist(), strict=True):
        if not (all(known) and far in (*neighbour[near], *behind[near])):
            problem = f"the blocked edge from {_at(edge[0])} to {_at(edge[1])} joins no two neighbouring locations"
            raise SceneError(source, problem, "Name two recorded locations one step apart")
    return np.concatenate([ends @ [len(places), 1], ends @ [1, len(places)]])


def _at(place: np.ndarray) -> str:
    return f"({place[0]:g}, {place[1]:g})"
