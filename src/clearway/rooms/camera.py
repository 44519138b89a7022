"""Where the camera stands and how it sees: pictures to take, as plain data.

Coordinates: x is MuJoCo's x, z (across the floor) is MuJoCo's y. Heading 0 looks along +z, 90 along +x.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from clearway.rooms.groups import CEILING_GROUP, SEEN_GROUP
from clearway.scenes import sensors

CAMERA_HEIGHT_M = 1.0
VERTICAL_FOV_DEG = 60.0
PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX = PICTURE_SIZE_PX = 300, 400  # of our own rooms


@dataclass(frozen=True)
class Shot:
    """A camera in its place (MuJoCo's free camera).

    Attributes:
        look_at_m: a point in the middle of the picture, x, z and height.
        distance_m: of the camera from that point.
        azimuth_deg: the direction it looks in across the floor, 0 along +x, 90 along +z.
        elevation_deg: 0 looks level, -90 straight down.
        moved_m: where the room's loose pieces stand for this picture, how far along x and along z and upwards each has
            been moved (`pieces`); empty leaves them where the shot before had them, at first where they were built.
    """

    look_at_m: tuple[float, float, float]
    distance_m: float
    azimuth_deg: float
    elevation_deg: float
    moved_m: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True)
class View:
    """The pictures to take of a room, all with one lens.

    Attributes:
        shots: one for each picture.
        height_px, width_px: size of a picture.
        vertical_extent: angle of view from the lower to the upper edge in degrees; metres if orthographic.
        orthographic: without perspective, all rays of sight are parallel.
        groups: the geom groups that show.
        sensor: what takes the pictures, one of `sensors.SENSORS`.
        fast: for small pictures with perspective, sides of even length: what is out of sight is not drawn, and colours
            are means of more pixels instead of several samples a pixel. The same to the eye, not bit for bit.
    """

    shots: tuple[Shot, ...]
    height_px: int
    width_px: int
    vertical_extent: float
    orthographic: bool
    groups: tuple[int, ...]
    sensor: str = sensors.RGB
    fast: bool = False

    def __post_init__(self) -> None:
        """Check what `fast` needs."""
        if self.fast and (self.orthographic or self.height_px % 2 or self.width_px % 2):
            raise ValueError("fast pictures have perspective and an even number of rows and columns")

    def empty_pictures(self, count: int) -> np.ndarray:
        """Room for so many pictures, (count, height_px, width_px, 3) uint8 RGB or as `Sensor.kept` has them."""
        sensor = sensors.SENSORS[self.sensor](self.height_px, self.width_px)
        return np.empty((count, *sensor.shape), sensor.kept_dtype)


def first_person_view(
    locations_m: np.ndarray,
    headings_deg: np.ndarray,
    *,
    camera_m: float = CAMERA_HEIGHT_M,
    height_px: int = PICTURE_HEIGHT_PX,
    width_px: int = PICTURE_WIDTH_PX,
    groups: tuple[int, ...] = (SEEN_GROUP, CEILING_GROUP),
    fast: bool = False,
) -> View:
    """What the agent sees at each pose.

    Args:
        locations_m: (S, 2) x and z.
        headings_deg: (S,).
        camera_m: height of the camera in the world.
        height_px: of a picture.
        width_px: of a picture.
        groups: the geom groups that show.
        fast: see `View`.
    """
    shots = (
        first_person_shot(float(x_m), float(z_m), float(heading_deg), height_m=camera_m)
        for (x_m, z_m), heading_deg in zip(locations_m, headings_deg, strict=True)
    )
    return eye_view(shots, height_px=height_px, width_px=width_px, groups=groups, fast=fast)


def eye_view(
    shots: Iterable[Shot] = (),
    *,
    height_px: int = PICTURE_HEIGHT_PX,
    width_px: int = PICTURE_WIDTH_PX,
    groups: tuple[int, ...] = (SEEN_GROUP, CEILING_GROUP),
    fast: bool = False,
) -> View:
    """Pictures through the agent's lens; arguments as of `first_person_view`."""
    return View(
        shots=tuple(shots),
        height_px=height_px,
        width_px=width_px,
        vertical_extent=VERTICAL_FOV_DEG,
        orthographic=False,
        groups=groups,
        fast=fast,
    )


def first_person_shot(
    x_m: float,
    z_m: float,
    heading_deg: float,
    *,
    height_m: float = CAMERA_HEIGHT_M,
    pitch_deg: float = 0.0,
    moved_m: tuple[tuple[float, float, float], ...] = (),
) -> Shot:
    """The agent's camera above a point of the floor; a pitch above 0 looks up. See `Shot` for `moved_m`."""
    azimuth_deg = 90.0 - heading_deg
    azimuth, pitch = np.radians(azimuth_deg), np.radians(pitch_deg)
    level = float(np.cos(pitch))
    ahead_m = (
        x_m + level * float(np.cos(azimuth)),
        z_m + level * float(np.sin(azimuth)),
        height_m + float(np.sin(pitch)),
    )
    return Shot(ahead_m, distance_m=1.0, azimuth_deg=azimuth_deg, elevation_deg=pitch_deg, moved_m=moved_m)
