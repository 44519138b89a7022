"""Where light is stopped in a room: a grid of voxels, and rays that march through it in long safe steps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from clearway.rooms.parts import Part

VOXEL_M = 0.04
MAX_STEPS = 96


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
        active = np.arange(len(points_m))
        here = np.ascontiguousarray((points_m.astype(np.float32) / np.float32(VOXEL_M) + np.float32(1)).T)
        step_by = np.ascontiguousarray(directions.astype(np.float32).T)
        for _ in range(MAX_STEPS):
            np.clip(here, 0, last, out=here)
            x, y, z = here.astype(np.int32)
            free = field[(x * size_y + y) * size_z + z]
            moving = np.flatnonzero((free > 0) & (travelled[active] < limits[active]))
            if len(moving) < len(active):
                active, free = active[moving], free[moving]
                here, step_by = here.take(moving, axis=1), step_by.take(moving, axis=1)
            if not len(active):
                break
            step = np.maximum(free.astype(np.float32) - np.float32(0.9), np.float32(0.6))
            here += step_by * step
            travelled[active] += step
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
    distance = ndimage.distance_transform_cdt(~solid, "chessboard")
    return Occupancy(np.minimum(distance, 255).astype(np.uint8))


def _fill(solid: np.ndarray, part: Part) -> None:
    """Mark the voxels of a part; thin parts are thickened to half a voxel on each side of their middle."""
    reach = np.abs(part.rotation) @ part.half_extents_m
    low = np.maximum(((part.centre_m - reach) / VOXEL_M).astype(int), 0)
    high = np.minimum(((part.centre_m + reach) / VOXEL_M).astype(int) + 1, np.array(solid.shape) - 2)
    if np.any(low >= high):
        return
    axes = [(np.arange(a, b) + 0.5) * VOXEL_M for a, b in zip(low, high, strict=True)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    local = (centres - part.centre_m) @ part.rotation
    half = np.maximum(part.half_extents_m, 0.5 * VOXEL_M)
    inside = np.all(np.abs(local) <= half, axis=-1)
    if part.round:
        inside &= ((local[..., :2] / half[:2]) ** 2).sum(axis=-1) <= 1
    x, y, z = (slice(a + 1, b + 1) for a, b in zip(low, high, strict=True))
    solid[x, y, z] |= inside
