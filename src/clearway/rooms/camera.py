"""Where the camera stands and how it sees: pictures to take, as plain data, and the taking of them.

Coordinates: x is MuJoCo's x, z (across the floor) is MuJoCo's y. Heading 0 looks along +z, 90 along +x.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass

import mujoco
import numpy as np

from clearway.rooms.groups import CEILING_GROUP, SEEN_GROUP
from clearway.rooms.obstacles import bounding_boxes
from clearway.scenes import sensors

CAMERA_HEIGHT_M = 1.0
VERTICAL_FOV_DEG = 60.0
PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX = 300, 400
SPARE_GEOMS = 100  # the renderer adds a few of its own to the model's
ALL_GROUPS = range(mujoco.mjNGROUP)


@dataclass(frozen=True)
class Shot:
    """A camera in its place (MuJoCo's free camera).

    Attributes:
        look_at_m: a point in the middle of the picture, x, z and height.
        distance_m: of the camera from that point.
        azimuth_deg: the direction it looks in across the floor, 0 along +x, 90 along +z.
        elevation_deg: 0 looks level, -90 straight down.
        moved_m: where the room's loose pieces stand for this picture, how far along x and along z and upwards each has
            been moved (`pieces`); empty leaves them where they were built.
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


def take_pictures(model: mujoco.MjModel, view: View, shots: Iterable[Shot]) -> Iterator[np.ndarray]:
    """The pictures of some shots one by one, as `View.empty_pictures` has them; the array may be used again.

    Sets the lens of `view` in `model`; the view's own shots do not count. Needs a process with a working MUJOCO_GL
    backend (see `render`), which opens before the first shot is asked for.
    """
    depth = view.sensor == sensors.DEPTH
    finer = view.fast and not depth
    height_px, width_px = (px * 3 // 2 if finer else px for px in (view.height_px, view.width_px))
    lens = model.vis.global_
    lens.offheight, lens.offwidth = height_px, width_px
    lens.fovy = view.vertical_extent
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    shown = mujoco.MjvOption()
    shown.geomgroup[:] = 0
    shown.geomgroup[list(view.groups)] = 1
    sight = Sight(model, data, view) if view.fast else None
    sensor = sensors.SENSORS[view.sensor](view.height_px, view.width_px)
    picture = np.empty((height_px, width_px, *sensor.shape[2:]), sensor.dtype)
    if depth or finer:
        model.vis.quality.offsamples = 0  # of depth, several samples a pixel might be blended over an edge
    max_geom = model.ngeom + model.nsite + SPARE_GEOMS
    with mujoco.Renderer(model, height_px, width_px, max_geom=max_geom) as renderer:
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # the rooms' light is baked
        if depth:
            renderer.enable_depth_rendering()
        for shot in shots:
            if shot.moved_m:
                data.mocap_pos[:] = shot.moved_m
                mujoco.mj_forward(model, data)
            with sight.of(shot) if sight is not None else nullcontext():
                renderer.update_scene(data, _free_camera(shot, view.orthographic), shown)
            taken = renderer.render(out=picture)
            yield sensor.kept(two_thirds(taken) if finer else taken)


def two_thirds(picture: np.ndarray) -> np.ndarray:
    """A (3 h, 3 w, 3) uint8 picture at two thirds of its size: the mean of each pixel's area, rounded."""
    low, middle, high = (picture[part::3].astype(np.uint16) for part in range(3))
    rows = np.stack([2 * low + middle, middle + 2 * high], axis=1).reshape(-1, *picture.shape[1:])
    low, middle, high = (rows[:, part::3] for part in range(3))
    both = np.stack([2 * low + middle, middle + 2 * high], axis=2).reshape(len(rows), -1, picture.shape[2])
    return ((both + 4) // 9).astype(np.uint8)


class Sight:
    """Which geoms of a model can be in a picture: `mjr_render` draws all, wherever the camera looks."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, view: View) -> None:
        """Of a view's lens; where a mirror may show what is behind the camera, all geoms count."""
        self._model, self._data = model, data
        self._groups = model.geom_group.copy()
        hidden = [group for group in ALL_GROUPS if group not in view.groups]
        materials = model.geom_matid[np.isin(self._groups, view.groups)]
        mirrors = np.any(model.mat_reflectance[materials[materials >= 0]] > 0)
        self._hidden_group = hidden[0] if hidden and not mirrors else None
        self._boxes_m = bounding_boxes(model, data)
        up = float(np.tan(np.radians(view.vertical_extent / 2)))
        self._slopes = up, up * view.width_px / view.height_px

    @contextmanager
    def of(self, shot: Shot) -> Iterator[None]:
        """For the block, geoms that cannot be in the picture are in a group that does not show."""
        if self._hidden_group is None:
            yield
            return
        seen = self._seen(shot)
        self._model.geom_group[:] = np.where(seen, self._groups, self._hidden_group)
        try:
            yield
        finally:
            self._model.geom_group[:] = self._groups

    def _seen(self, shot: Shot) -> np.ndarray:
        """Which geoms' boxes reach into the pyramid of sight, (geoms,) bool."""
        if shot.moved_m:
            self._boxes_m = bounding_boxes(self._model, self._data)
        centres_m, halves_m = self._boxes_m
        azimuth, elevation = np.radians(shot.azimuth_deg), np.radians(shot.elevation_deg)
        level, across = np.cos(elevation), np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
        ahead = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
        above = np.cross(across, ahead)
        slope_up, slope_across = self._slopes
        inwards = np.stack(
            [
                ahead,
                ahead * slope_across + across,
                ahead * slope_across - across,
                ahead * slope_up + above,
                ahead * slope_up - above,
            ],
            axis=1,
        )
        camera_m = np.array(shot.look_at_m) - ahead * shot.distance_m
        farthest_m = (centres_m - camera_m) @ inwards + halves_m @ np.abs(inwards)
        return np.all(farthest_m >= 0, axis=1)


def _free_camera(shot: Shot, orthographic: bool) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = shot.look_at_m
    camera.distance = shot.distance_m
    camera.azimuth = shot.azimuth_deg
    camera.elevation = shot.elevation_deg
    camera.orthographic = int(orthographic)
    return camera
