"""`Eyes`: a room's cameras, open in processes of their own, so that ours may have loaded anything."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from clearway.rooms.camera import Shot, eye_view
from clearway.rooms.render import studio
from clearway.scenes.sensors import Sensor

if TYPE_CHECKING:
    import mujoco


class Eyes:
    """What some cameras see of a room, from the same places.

    Args:
        model: the compiled room.
        sensors: the cameras; all pictures have one size.
        workers: processes for each camera; None: one a core.
    """

    def __init__(self, model: mujoco.MjModel, sensors: Sequence[Sensor], workers: int | None = None) -> None:
        self._sensors = tuple(sensors)
        opened = ExitStack()
        height_px, width_px = self._sensors[0].shape[:2]
        view = eye_view(height_px=height_px, width_px=width_px)
        self._cameras = {
            sensor.name: opened.enter_context(studio(model, replace(view, sensor=sensor.name), workers=workers))
            for sensor in self._sensors
        }
        self.close = weakref.finalize(self, opened.close)
        """End the processes; a second call does nothing."""

    def __call__(self, shots: Sequence[Shot]) -> dict[str, np.ndarray]:
        """(shots, *sensor.shape) by each sensor's name, in its unit.

        Raises:
            RenderError: this machine cannot render, or a renderer process died.
        """
        return {sensor.name: sensor.values(self._cameras[sensor.name](shots)) for sensor in self._sensors}
