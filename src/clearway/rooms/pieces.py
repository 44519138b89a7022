"""Pieces of furniture that can be moved: which obstacles they are, and which visible parts belong to each.

A piece is an obstacle that stands on the floor, or several that were put there as one (`Room.one_piece`). The rooms are
built part by part, so what is visible of a piece is found by its place: every part over its footprint that stands in
it, on it, or on such a part. Walls, ceilings, what hangs on them, and the light baked into them stay.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from clearway.rooms.frame import rotation
from clearway.rooms.groups import CEILING_GROUP, SHELL_NAME
from clearway.rooms.obstacles import obstacle_geoms
from clearway.rooms.parts import Part

ON_FLOOR_M = 0.1  # an obstacle that begins lower stands on the floor
OVERHANG_M = 0.12  # how far a part's middle may lie outside the footprint: leaves, lamp shades
GAP_M = 0.03  # between a part and what it stands on
AT_WALL_M = 0.06  # a part so near to a wall, higher than the piece, hangs on the wall
FIXED = -1


def loose_obstacles(spec: mujoco.MjSpec) -> list[mujoco.MjsGeom]:
    """The obstacles of a room that can be moved, in the spec's order."""
    return [geom for geom in obstacle_geoms(spec) if is_loose(geom)]


def numbered(obstacles: Sequence[mujoco.MjsGeom]) -> list[int]:
    """The piece that each obstacle that can be moved belongs to: 0, 1, ... in their order."""
    names = [geom.name.partition("/")[0] or number for number, geom in enumerate(obstacles)]
    order = {name: number for number, name in enumerate(dict.fromkeys(names))}
    return [order[name] for name in names]


def piece_count(spec: mujoco.MjSpec) -> int:
    """How many pieces of a room can be moved."""
    return len(set(numbered(loose_obstacles(spec))))


def is_loose(geom: mujoco.MjsGeom) -> bool:
    """Whether an obstacle is a piece of furniture that stands on the floor."""
    return not geom.name.startswith(SHELL_NAME) and geom.pos[2] - _half_size_m(geom)[2] < ON_FLOOR_M


def _half_size_m(geom: mujoco.MjsGeom) -> np.ndarray:
    """(3,) half the size of the box around a box or an upright cylinder, in its own frame."""
    if geom.type == mujoco.mjtGeom.mjGEOM_BOX:
        return np.array(geom.size)
    radius_m, half_m = geom.size[:2]
    return np.array([radius_m, radius_m, half_m])


def pieces_of_parts(
    obstacles: Sequence[mujoco.MjsGeom], parts: Sequence[Part], floor_m: tuple[float, float]
) -> np.ndarray:
    """The piece that each part belongs to, (parts,) int, as `numbered`; FIXED for those that stay.

    Args:
        obstacles: those of the pieces (`loose_obstacles`).
        parts: visible ones.
        floor_m: width and depth of the floor.
    """
    piece, numbers = np.full(len(parts), FIXED), numbered(obstacles)
    if not obstacles or not parts:
        return piece
    centres_m = np.array([part.centre_m for part in parts])
    half_heights_m = np.array([np.abs(part.rotation[2]) @ part.half_extents_m for part in parts])
    undersides_m, tops_m = centres_m[:, 2] - half_heights_m, centres_m[:, 2] + half_heights_m
    outside_m = np.stack([_outside_m(geom, centres_m) for geom in obstacles], axis=1)
    nearest = outside_m.argmin(axis=1)
    hung = np.array([part.group == CEILING_GROUP for part in parts]) | (outside_m.min(axis=1) > OVERHANG_M)
    at_wall = np.minimum(centres_m[:, :2], np.array(floor_m) - centres_m[:, :2]).min(axis=1) < AT_WALL_M
    reached_m = np.array([geom.pos[2] + _half_size_m(geom)[2] for geom in obstacles])
    reaches_m = np.array([np.linalg.norm(_half_size_m(geom)[:2]) + OVERHANG_M for geom in obstacles])
    lengths_m = np.array([np.abs(part.rotation[:2] @ np.diag(part.half_extents_m)).max() for part in parts])
    hung |= at_wall & (undersides_m > reached_m[nearest] + GAP_M)
    hung |= lengths_m > reaches_m[nearest]  # skirting boards run along the wall behind it
    for part in np.argsort(undersides_m, kind="stable"):
        owner = nearest[part]
        if not hung[part] and undersides_m[part] <= reached_m[owner] + GAP_M:
            piece[part] = numbers[owner]
            reached_m[owner] = max(reached_m[owner], tops_m[part])
    return piece


def _outside_m(geom: mujoco.MjsGeom, points_m: np.ndarray) -> np.ndarray:
    """How far each of (N, 3) points lies outside the footprint of a piece, across the floor, (N,)."""
    local_m = (points_m - np.array(geom.pos)) @ rotation(np.array(geom.quat))
    beyond_m = np.maximum(np.abs(local_m[:, :2]) - _half_size_m(geom)[:2], 0)
    return np.linalg.norm(beyond_m, axis=1)
