"""`Eyes`: a room's cameras, open in processes of their own, so that ours may have loaded anything."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import replace
from functools import partial

import numpy as np

from clearway.live.live_room import LiveRoom
from clearway.rooms.camera import Shot
from clearway.rooms.detail import are_small
from clearway.rooms.render import MOST_WORKERS, photographers, process_count
from clearway.scenes.sensors import Sensor

Pictures = Callable[[], np.ndarray]
"""Waits for pictures: (shots, *sensor.shape) in the sensor's unit."""

MOST_SHARE = 8
SHARES = 2  # for each process in a step: fewer, and it waits for the last agent's move


class Eyes:
    """What some cameras see of a room, from the same places.

    Args:
        live: the room.
        sensors: the cameras; all pictures have one size.
        workers: processes for each camera, 16 at most; None: one a core.
    """

    def __init__(self, live: LiveRoom, sensors: Sequence[Sensor], workers: int | None = None) -> None:
        self._sensors = tuple(sensors)
        self._workers = process_count(workers, MOST_WORKERS)
        opened = ExitStack()
        height_px, width_px = self._sensors[0].shape[:2]
        view = live.lens(height_px, width_px, fast=are_small(height_px, width_px))
        self._cameras = {
            sensor.name: opened.enter_context(
                photographers(live.model, replace(view, sensor=sensor.name), workers=workers)
            )
            for sensor in self._sensors
        }
        self.close = weakref.finalize(self, opened.close)
        """End the processes; a second call does nothing."""

    def shares(self, lookers: list[int]) -> list[list[int]]:
        """Those who look, in groups that ask together, so that all processes have something to do."""
        size = max(1, min(MOST_SHARE, -(-len(lookers) // (SHARES * self._workers))))
        return [lookers[first : first + size] for first in range(0, len(lookers), size)]

    def ask(self, shots: Sequence[Shot]) -> dict[str, Pictures]:
        """What waits for the pictures, by each sensor's name; they are being taken meanwhile.

        It raises RenderError where this machine cannot render, or a renderer process died.
        """
        taking = {name: camera.submit(shots) for name, camera in self._cameras.items()}
        return {sensor.name: partial(_taken, taking[sensor.name], sensor) for sensor in self._sensors}


def _taken(taking: Future[np.ndarray], sensor: Sensor) -> np.ndarray:
    return sensor.values(taking.result())
