"""`Sensor`: what an observation is, its name, shape, dtype, unit and range; and `Readings`, a sensor's at every pose.

The RGB camera is one, depth the second. A third is one more entry of `SENSORS` and whatever takes its pictures: scene
files, environments and tables go by what a `Sensor` says of itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import SceneError

if TYPE_CHECKING:
    from clearway.scenes.scene import Observations

RGB, DEPTH = "rgb", "depth"
DEPTH_FAR_M = 20.0
DEPTH_STEP_M = 0.001
STEPS_DTYPE = "uint16"


@dataclass(frozen=True)
class Sensor:
    """What one observation of a sensor is.

    Attributes:
        name: for example "depth"; small letters, digits and underscores.
        shape: of one observation, for example (height, width).
        dtype: of its values as an agent gets them, "uint8", "uint16" or "float32".
        unit: of its values, for example "m"; empty where they have none.
        low: smallest value.
        high: largest value.
        step: values are whole multiples of it, and are kept as such (uint16); None: they are kept as they are.
    """

    name: str
    shape: tuple[int, ...]
    dtype: str
    unit: str
    low: float
    high: float
    step: float | None = None

    @property
    def kept_dtype(self) -> str:
        """Of the values as memory and files keep them."""
        return self.dtype if self.step is None else STEPS_DTYPE

    @property
    def kept_bytes(self) -> int:
        """Of one observation, in memory."""
        return math.prod(self.shape) * np.dtype(self.kept_dtype).itemsize

    def kept(self, values: np.ndarray) -> np.ndarray:
        """Values as they are kept: where there are steps, cut to the range and rounded to them."""
        if self.step is None:
            return values
        return np.rint(np.clip(values, self.low, self.high) / self.step).astype(self.kept_dtype)

    def values(self, kept: np.ndarray) -> np.ndarray:
        """The values that were kept."""
        return kept if self.step is None else (kept * self.step).astype(self.dtype)

    def to_json(self) -> dict[str, object]:
        """As JSON values: what an observation is."""
        shown = ("name", "shape", "dtype", "unit", "low", "high")
        return {key: list(self.shape) if key == "shape" else getattr(self, key) for key in shown}

    def described(self) -> str:
        """In one line, for people."""
        size = " x ".join(map(str, self.shape))
        return f"{self.name} ({size} {self.dtype}, {self.low:g} to {self.high:g}{self.unit and ' ' + self.unit})"


def rgb(height_px: int, width_px: int) -> Sensor:
    """The colour camera: (height_px, width_px, 3) uint8."""
    return Sensor(RGB, (height_px, width_px, 3), "uint8", "", 0, 255)


def depth(height_px: int, width_px: int) -> Sensor:
    """The depth camera: (height_px, width_px) float32 metres, in whole millimetres, through the lens of the colour one.

    Depth is measured along the middle of the view, as depth cameras do: a wall straight ahead has one depth all over.
    What is 20 m away or more, or nothing at all, is 20.
    """
    return Sensor(DEPTH, (height_px, width_px), "float32", "m", 0, DEPTH_FAR_M, DEPTH_STEP_M)


SENSORS: Mapping[str, Callable[[int, int], Sensor]] = {RGB: rgb, DEPTH: depth}
"""What MuJoCo can take of a room, by name: from height and width in pixels to the sensor."""


@dataclass(frozen=True, eq=False)
class Readings:
    """What a sensor measured at every pose; index with an int, a slice or an int array.

    Attributes:
        sensor: which.
        raw: (S, *sensor.shape), values as they are kept (`Sensor.kept`): an array, or a file read on demand.
        source: the file, for errors; empty where there is none.
    """

    sensor: Sensor
    raw: Observations
    source: str = ""

    @property
    def shape(self) -> tuple[int, ...]:
        """(S, *sensor.shape)."""
        return self.raw.shape

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        """The values asked for, of the sensor's dtype and in its unit.

        Raises:
            SceneError: a value is out of the sensor's range, or not finite; or the file is gone or damaged.
        """
        return self.sensor.values(self.checked(index))

    def checked(self, index: int | slice | np.ndarray) -> np.ndarray:
        """As `self[index]`, but values as they are kept."""
        raw, sensor = self.raw[index], self.sensor
        scale = sensor.step or 1.0
        low, high = sensor.low / scale, sensor.high / scale
        spare = 1e-6 * (high - low)  # for a limit that is no exact number of steps
        # NaN fails the comparison
        if raw.size and not (low - spare <= raw.min() and raw.max() <= high + spare):
            problem = f"holds values out of {sensor.low:g} to {sensor.high:g}{sensor.unit and ' ' + sensor.unit}"
            raise SceneError(self.source or "the scene", problem, "Render the scene again", sensor.name)
        return raw


def check_names(names: Sequence[str]) -> None:
    """Check which sensors are asked for: known ones, each once, the colour camera among them. Raises SceneError."""
    if isinstance(names, str):
        raise SceneError("sensors", f"{names!r} is a text", f"Give names, such as ('{RGB}', '{DEPTH}')")
    if not isinstance(names, Sequence):
        raise SceneError("sensors", f"{names!r:.60} is no list of names", f"Give names, such as ('{RGB}', '{DEPTH}')")
    unknown = [name for name in names if not isinstance(name, str) or name not in SENSORS]
    if unknown:
        raise SceneError("sensors", f"there is no {unknown[0]!r}", f"Choose among {', '.join(SENSORS)}")
    if len(set(names)) < len(names) or RGB not in names:
        problem = f"{' '.join(names)!r} leaves out {RGB} or names one twice"
        raise SceneError("sensors", problem, f"Name each once, and {RGB} among them")
