"""Where a piece of furniture stands: a small immutable frame on the floor, and the quaternions it needs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
"""The quaternion (w, x, y, z) that turns nothing."""


def turn(axis: str, angle_deg: float) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of a rotation by `angle_deg` about the local axis "x", "y" or "z"."""
    half = math.radians(angle_deg) / 2
    part = {name: math.sin(half) if name == axis else 0.0 for name in "xyz"}
    return math.cos(half), part["x"], part["y"], part["z"]


def compose(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Product of two quaternions (w, x, y, z): `second` is applied in the frame that `first` turns."""
    aw, ax, ay, az = first
    bw, bx, by, bz = second
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def rotation(quat: np.ndarray) -> np.ndarray:
    """The (3, 3) rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quat
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def along(direction: np.ndarray) -> tuple[float, float, float, float]:
    """A quaternion (w, x, y, z) that turns +z to the (3,) direction."""
    x, y, z = np.asarray(direction, float) / np.linalg.norm(direction)
    if z < -1 + 1e-9:
        return 0.0, 1.0, 0.0, 0.0
    quat = np.array([1 + z, -y, x, 0.0])
    quat /= np.linalg.norm(quat)
    return tuple(quat)


@dataclass(frozen=True)
class Frame:
    """A place on the floor and a direction; furniture faces its own +y.

    Attributes:
        x_m, y_m, z_m: the origin, in room coordinates.
        yaw_deg: counter-clockwise turn about the vertical.
    """

    x_m: float
    y_m: float
    yaw_deg: float = 0.0
    z_m: float = 0.0

    def point(self, x_m: float, y_m: float, z_m: float) -> np.ndarray:
        """The (3,) room coordinates of a point given in this frame."""
        yaw = math.radians(self.yaw_deg)
        c, s = math.cos(yaw), math.sin(yaw)
        return np.array([self.x_m + c * x_m - s * y_m, self.y_m + s * x_m + c * y_m, self.z_m + z_m])

    def orientation(self, tilt: tuple[float, float, float, float] = UPRIGHT) -> np.ndarray:
        """The (4,) room quaternion of something tilted by `tilt` in this frame."""
        return compose(np.array(turn("z", self.yaw_deg)), np.array(tilt))

    def moved(self, x_m: float, y_m: float, z_m: float = 0.0, yaw_deg: float = 0.0) -> Frame:
        """A frame given relative to this one."""
        x, y, z = self.point(x_m, y_m, z_m)
        return Frame(float(x), float(y), self.yaw_deg + yaw_deg, float(z))
