"""What a camera can see of a room: its view frustum, and the geoms that reach into it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from clearway.rooms.camera import Shot, View
from clearway.rooms.obstacles import bounding_boxes

ALL_GROUPS = range(mujoco.mjNGROUP)


class Frustum:
    """Which geoms of a model can be in a picture: `mjr_render` draws all, wherever the camera looks."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, view: View) -> None:
        """Of a view's lens; with a mirror in sight, which may show what is behind the camera, all geoms count."""
        self._model, self._data = model, data
        self._groups = model.geom_group.copy()
        self._hidden_group = next((group for group in ALL_GROUPS if group not in view.groups), None)
        reflectance = np.append(model.mat_reflectance, 0.0)  # of no material, -1
        self._mirrors = np.isin(self._groups, view.groups) & (reflectance[model.geom_matid] > 0)
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
        if np.any(seen & self._mirrors):
            yield
            return
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
