"""What a live environment's observations are called, and their spaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium import spaces

from clearway.live_envs.arguments import CLEARANCE
from clearway.scenes.sensors import RGB, Sensor


def sensor_keys(sensor: Sensor | str) -> tuple[str, str]:
    """Keys of the poses' observations by a sensor and of the target's, as in the environments on the grid."""
    name = sensor if isinstance(sensor, str) else sensor.name
    return ("observation", "target") if name == RGB else (name, f"target_{name}")


def space_of(sensors: Sequence[Sensor], leading: tuple[int, ...]) -> spaces.Dict:
    """Of the observations of one environment; `leading` is the shape of the poses that it keeps, () or (K,)."""
    boxes: dict[str, spaces.Space] = {}
    for sensor in sensors:
        dtype = np.dtype(sensor.dtype).type
        poses, target = sensor_keys(sensor)
        boxes[poses] = spaces.Box(sensor.low, sensor.high, (*leading, *sensor.shape), dtype)
        if sensor.name != CLEARANCE:
            boxes[target] = spaces.Box(sensor.low, sensor.high, sensor.shape, dtype)
    return spaces.Dict(boxes)
