"""What the agent sees: observation spaces, and the features or pictures of any set of states.

States are numbered through all scenes, as in `World`. K poses of history, F features, pictures of height H and width W.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from gymnasium import spaces

from clearway.envs.world import World
from clearway.errors import EnvError
from clearway.scenes.scene import Observations, Scene

ObservationKind = Literal["features", "pictures"]
OBSERVATION_KINDS = ("features", "pictures")


class Features:
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


class Pictures:
    """The first-person pictures of states, read from the scenes when they are asked for.

    The pictures of the last call are kept, since an agent's history repeats them: a step reads one new picture.

    Attributes:
        shape: (H, W, 3).

    Raises:
        EnvError: a scene has no pictures, or pictures of another size than the first.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self._sources = [_pictures_of(scene) for scene in scenes]
        self._offsets = np.cumsum([0, *(scene.state_count for scene in scenes)])
        self.shape = tuple(self._sources[0].shape[1:])
        for scene, source in zip(scenes, self._sources, strict=True):
            if tuple(source.shape[1:]) != self.shape:
                sizes = f"pictures of {source.shape[1:]}, those of {scenes[0].name} are {self.shape}"
                raise EnvError(f"{scene.name}: {sizes}. Put scenes of one picture size in an environment")
        self._kept = np.empty(0, np.int64)
        self._pictures = np.empty((0, *self.shape), np.uint8)

    def space(self, *leading: int) -> spaces.Box:
        """Space of arrays of pictures, (*leading, H, W, 3)."""
        return spaces.Box(0, 255, (*leading, *self.shape), np.uint8)

    def read(self, states: np.ndarray) -> np.ndarray:
        """Pictures of states (...) int64, (..., H, W, 3) uint8."""
        wanted, position = np.unique(states, return_inverse=True)
        pictures = np.empty((len(wanted), *self.shape), np.uint8)
        _, here, there = np.intersect1d(wanted, self._kept, assume_unique=True, return_indices=True)
        pictures[here] = self._pictures[there]
        missing = np.setdiff1d(np.arange(len(wanted)), here, assume_unique=True)
        scene_of = np.searchsorted(self._offsets, wanted, side="right") - 1
        for scene in np.unique(scene_of[missing]):
            rows = missing[scene_of[missing] == scene]
            pictures[rows] = self._sources[scene][wanted[rows] - self._offsets[scene]]
        self._kept, self._pictures = wanted, pictures
        return pictures[position.reshape(np.shape(states))]


def _pictures_of(scene: Scene) -> Observations:
    if scene.observations is None:
        raise EnvError(f"{scene.name}: the scene has no pictures. Ask for observations='features'")
    return scene.observations


def _power_of_two_above(values: np.ndarray) -> float:
    """A bound of all values that sets of scenes of one encoder mostly share, so that their spaces are equal."""
    largest = float(np.abs(values).max(initial=0.0))
    if not np.isfinite(largest):
        raise EnvError("the scenes' features are not all finite. Encode the scenes again")
    return float(2.0 ** np.ceil(np.log2(max(largest, 1.0))))


def observation_source(scenes: Sequence[Scene], kind: ObservationKind, world: World) -> Features | Pictures:
    """Where observations of a kind come from.

    Raises:
        EnvError: the kind is unknown, or the scenes do not hold it.
    """
    if kind not in OBSERVATION_KINDS:
        raise EnvError(f"observations={kind!r} is unknown. Use one of {', '.join(map(repr, OBSERVATION_KINDS))}")
    return Features(world) if kind == "features" else Pictures(scenes)


def observation_space(source: Features | Pictures, history_length: int) -> spaces.Dict:
    """Space of one environment's observations: `observation` (K, ...), newest last, and `target` (...)."""
    return spaces.Dict(observation=source.space(history_length), target=source.space())
