"""What the agent sees: observation spaces, and the features or the sensors' pictures of any set of states.

States are numbered through all scenes, as in `World`. K poses of history, F features, pictures of height H and width W.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from gymnasium import spaces

from clearway.errors import EnvError, SceneError
from clearway.scenes.scene import Observations, Scene
from clearway.scenes.sensors import RGB, Sensor
from clearway.world.world import World

ObservationKind = Literal["features", "pictures"]
OBSERVATION_KINDS = ("features", "pictures")


class FeatureSource:
    """The features of states.

    Args:
        world: the tables, which are shared, not copied.

    Attributes:
        shape: (F,).

    Raises:
        EnvError: there are no features.
    """

    def __init__(self, world: World) -> None:
        if world.features is None:
            remedy = "Encode it, or ask for observations='pictures'"
            raise EnvError(f"{world.scene_names[0]}: the scene has no features. {remedy}")
        self._table = world.features.numpy()
        self._bound = _power_of_two_above(self._table)
        self.shape = self._table.shape[1:]

    def space(self, *leading: int) -> spaces.Box:
        """Space of arrays of features, (*leading, F)."""
        return spaces.Box(-self._bound, self._bound, (*leading, *self.shape), np.float32)

    def read(self, states: np.ndarray) -> np.ndarray:
        """Features of states (...) int64, (..., F) float32."""
        return self._table[states]


class PictureSource:
    """The first-person pictures of states by one sensor, read from the scenes when they are asked for.

    The pictures of the last call are kept, since an agent's history repeats them: a step reads one new picture.

    Args:
        scenes: in the order of the world's.
        sensor: name of the sensor.

    Attributes:
        sensor: what its pictures are.
        shape: of one of them, for example (H, W, 3).

    Raises:
        EnvError: a scene has no pictures of the sensor, or others than the first, in size, unit or range.
    """

    def __init__(self, scenes: Sequence[Scene], sensor: str = RGB) -> None:
        self._sources = [_pictures_of(scene, sensor) for scene in scenes]
        self.sensor, *others = [_sensor_of(scene, sensor) for scene in scenes]
        self._offsets = np.cumsum([0, *(scene.state_count for scene in scenes)])
        self.shape = tuple(self._sources[0].shape[1:])
        for scene, source in zip(scenes, self._sources, strict=True):
            if tuple(source.shape[1:]) != self.shape:
                sizes = f"pictures of {source.shape[1:]}, those of {scenes[0].name} are {self.shape}"
                raise EnvError(f"{scene.name}: {sizes}. Put scenes of one picture size in an environment")
        for scene, other in zip(scenes[1:], others, strict=True):
            if other != self.sensor:
                problem = f"its sensor is {other.described()}, that of {scenes[0].name} is {self.sensor.described()}"
                raise EnvError(f"{scene.name}: {problem}. Put scenes of one sensor in an environment")
        self._kept = np.empty(0, np.int64)
        self._pictures = np.empty((0, *self.shape), self.sensor.dtype)

    def space(self, *leading: int) -> spaces.Box:
        """Space of arrays of pictures, (*leading, *shape), bounded by the sensor's range."""
        sensor = self.sensor
        return spaces.Box(sensor.low, sensor.high, (*leading, *self.shape), np.dtype(sensor.dtype).type)

    def read(self, states: np.ndarray) -> np.ndarray:
        """Pictures of states (...) int64, (..., *shape) of the sensor's dtype and in its unit."""
        wanted, position = np.unique(states, return_inverse=True)
        pictures = np.empty((len(wanted), *self.shape), self.sensor.dtype)
        _, here, there = np.intersect1d(wanted, self._kept, assume_unique=True, return_indices=True)
        pictures[here] = self._pictures[there]
        missing = np.setdiff1d(np.arange(len(wanted)), here, assume_unique=True)
        scene_of = np.searchsorted(self._offsets, wanted, side="right") - 1
        for scene in np.unique(scene_of[missing]):
            rows = missing[scene_of[missing] == scene]
            pictures[rows] = self._sources[scene][wanted[rows] - self._offsets[scene]]
        self._kept, self._pictures = wanted, pictures
        return pictures[position.reshape(np.shape(states))]


def _pictures_of(scene: Scene, sensor: str) -> Observations:
    if not scene.sensors:
        raise EnvError(f"{scene.name}: the scene has no pictures. Ask for observations='features'")
    try:
        return scene.seen_by(sensor)
    except SceneError as fault:
        raise EnvError(str(fault)) from fault


def _sensor_of(scene: Scene, name: str) -> Sensor:
    return next(sensor for sensor in scene.sensors if sensor.name == name)


def _power_of_two_above(values: np.ndarray) -> float:
    """A bound of all values that sets of scenes of one encoder mostly share, so that their spaces are equal."""
    largest = float(np.abs(values).max(initial=0.0))
    if not np.isfinite(largest):
        raise EnvError("the scenes' features are not all finite. Encode the scenes again")
    return float(2.0 ** np.ceil(np.log2(max(largest, 1.0))))


Sources = dict[tuple[str, str], FeatureSource | PictureSource]
"""Where observations come from, by the keys of the poses' and of the target's."""


def observation_sources(
    scenes: Sequence[Scene], kind: ObservationKind, sensors: Sequence[str], world: World
) -> Sources:
    """Where observations of a kind come from: features, or the pictures of each sensor.

    Raises:
        EnvError: the kind is unknown, sensors are asked for beside features, or the scenes do not hold them.
    """
    if kind not in OBSERVATION_KINDS:
        raise EnvError(f"observations={kind!r} is unknown. Use one of {', '.join(map(repr, OBSERVATION_KINDS))}")
    names = list(sensors) if isinstance(sensors, Sequence) and not isinstance(sensors, str) else []
    if not names or not all(isinstance(name, str) for name in names) or len({*names}) < len(names):
        raise EnvError(f"sensors={sensors!r}: expected names, each once, such as ('rgb', 'depth')")
    if kind == "pictures":
        return {_keys(name): PictureSource(scenes, name) for name in sensors}
    if tuple(sensors) != (RGB,):
        raise EnvError(f"sensors={sensors!r}: features are of one encoder. Ask for observations='pictures'")
    return {_keys(RGB): FeatureSource(world)}


def _keys(sensor: str) -> tuple[str, str]:
    return ("observation", "target") if sensor == RGB else (sensor, f"target_{sensor}")


def observation_space(sources: Sources, history_length: int) -> spaces.Dict:
    """Space of one environment's observations: of the poses (K, ...), newest last, and of the target (...)."""
    boxes: dict[str, spaces.Space] = {}
    for (poses, target), source in sources.items():
        boxes |= {poses: source.space(history_length), target: source.space()}
    return spaces.Dict(boxes)
