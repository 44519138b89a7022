"""Where light is stopped in a room: a grid of voxels, and rays that march through it in long safe steps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from clearway.rooms.parts import Part

VOXEL_M = 0.04
MAX_STEPS = 96
FAR = 254  # voxels


@dataclass(frozen=True, eq=False)
class Occupancy:
    """The solid parts of a room.

    Attributes:
        free_voxels: (X, Y, Z) uint8, distance to the nearest solid voxel in voxels (chessboard); 0 is solid.
            The room's shell is a solid layer of one voxel around it.
    """

    free_voxels: np.ndarray

    def distance_m(
        self, points_m: np.ndarray, directions: np.ndarray, limit_m: float | np.ndarray = np.inf
    ) -> np.ndarray:
        """How far light travels from (N, 3) points along (N, 3) unit vectors, (N,) float32 metres.

        Rays that have come farther than `limit_m`, one for all or (N,), stop there.
        """
        field = self.free_voxels.reshape(-1)
        last = np.array(self.free_voxels.shape, np.float32)[:, None] - 1
        _, size_y, size_z = self.free_voxels.shape
        travelled = np.zeros(len(points_m), np.float32)
        limits = np.broadcast_to(np.asarray(limit_m / VOXEL_M, np.float32), len(points_m))
        active, so_far = np.arange(len(points_m)), travelled.copy()
        here = np.ascontiguousarray((points_m.astype(np.float32) / np.float32(VOXEL_M) + np.float32(1)).T)
        step_by = np.ascontiguousarray(directions.astype(np.float32).T)
        np.clip(here, 0, last, out=here)  # no step leads beyond the shell
        for _ in range(MAX_STEPS):
            x, y, z = here.astype(np.int32)
            free = field[(x * size_y + y) * size_z + z]
            moving = np.flatnonzero((free > 0) & (so_far < limits))
            if len(moving) < len(active):
                travelled[active] = so_far
                active, free, so_far, limits = active[moving], free[moving], so_far[moving], limits[moving]
                here, step_by = here.take(moving, axis=1), step_by.take(moving, axis=1)
            if not len(active):
                break
            step = np.maximum(free.astype(np.float32) - np.float32(0.9), np.float32(0.6))
            here += step_by * step
            so_far += step
        travelled[active] = so_far
        return travelled * VOXEL_M

    def is_solid(self, points_m: np.ndarray) -> np.ndarray:
        """Whether each of (N, 3) points lies in something solid or outside the room, (N,) bool."""
        voxels = np.clip((points_m / VOXEL_M + 1).astype(int), 0, np.array(self.free_voxels.shape) - 1)
        return self.free_voxels[tuple(voxels.T)] == 0


def occupancy_of(size_m: tuple[float, float, float], parts: Iterable[Part]) -> Occupancy:
    """The voxels of a room of that size (x, y, z) with its parts."""
    count = np.ceil(np.array(size_m) / VOXEL_M - 1e-6).astype(int)
    solid = np.ones(count + 2, bool)
    solid[1:-1, 1:-1, 1:-1] = False
    for part in parts:
        if part.casts_shadow:
            _fill(solid, part)
    return Occupancy(chessboard_distance(solid))


def chessboard_distance(solid: np.ndarray) -> np.ndarray:
    """Steps of a chess king from each voxel to the nearest solid one, at most FAR, (X, Y, Z) uint8.

    Axis by axis: a way to a solid voxel of another plane goes to the next plane first, straight or aslant. With bytes
    in planes that is three times as fast as `scipy.ndimage.distance_transform_cdt`.
    """
    near = np.where(solid, np.uint8(0), np.uint8(FAR))
    for axis in (2, 1, 0):
        planes = np.ascontiguousarray(np.moveaxis(near, axis, 0))
        for way in (planes, planes[::-1]):
            for before, here in pairwise(way):
                reached = before + np.uint8(1)
                for aslant in range(axis, 2):  # axes of the plane along which the distances are whole already
                    straight, lines = reached.copy().swapaxes(0, aslant), reached.swapaxes(0, aslant)
                    np.minimum(lines[1:], straight[:-1], out=lines[1:])
                    np.minimum(lines[:-1], straight[1:], out=lines[:-1])
                np.minimum(here, reached, out=here)
        near = np.moveaxis(planes, 0, axis)
    return np.ascontiguousarray(near)


def _fill(solid: np.ndarray, part: Part) -> None:
    """Mark the voxels of a part; thin parts are thickened to half a voxel on each side of their middle."""
    rotation, half_m = part.rotation, part.half_extents_m
    reach_m = np.abs(rotation) @ half_m
    low = np.maximum(((part.centre_m - reach_m) / VOXEL_M).astype(int), 0).tolist()
    high = np.minimum(((part.centre_m + reach_m) / VOXEL_M).astype(int) + 1, np.array(solid.shape) - 2).tolist()
    if any(a >= b for a, b in zip(low, high, strict=True)):
        return
    centre_m = part.centre_m.tolist()
    x_m, y_m, z_m = ((np.arange(a, b) + 0.5) * VOXEL_M - c for a, b, c in zip(low, high, centre_m, strict=True))
    thick_m = np.maximum(half_m, 0.5 * VOXEL_M)
    local_m = x_m[:, None, None, None] * rotation[0] + y_m[:, None, None] * rotation[1]
    upright = rotation[2].tolist() == [0, 0, 1]
    if not upright:  # else the voxels above one another lie alike across the floor
        local_m = local_m + z_m[:, None] * rotation[2]
    within = np.abs(local_m) <= thick_m
    inside = within[..., 0] & within[..., 1]
    if part.round:
        inside &= ((local_m[..., :2] / thick_m[:2]) ** 2).sum(axis=-1) <= 1
    inside = inside & (np.abs(z_m) <= thick_m[2] if upright else within[..., 2])
    x, y, z = (slice(a + 1, b + 1) for a, b in zip(low, high, strict=True))
    solid[x, y, z] |= inside
