"""The options of `reset`: which environments begin anew, and in which scene, with which target, from which start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from clearway.envs.arguments import RESET_MASK, as_array
from clearway.errors import EnvError
from clearway.world.world import DistanceTable, World

EPISODE_OPTIONS = ("scene", "target", "start")


@dataclass(frozen=True)
class EpisodeChoice:
    """What the options of a reset leave open for B environments.

    Attributes:
        allowed: (B, M) bool, the targets that may be drawn; at least one a row.
        start: (B,) int64, first states in the numbering of all scenes; None to draw them.
    """

    allowed: np.ndarray
    start: np.ndarray | None


def episode_choice(
    options: Mapping[str, Any], world: World, distances: DistanceTable, index: np.ndarray, env_count: int
) -> EpisodeChoice | None:
    """What the options ask of the new episodes of the environments in index (B,); None where they ask nothing.

    Args:
        options: `scene` (a name), `target` and `start` (state ids in the scene's own numbering), each one value for
            all environments or one an environment (N,).
        world: the tables.
        distances: steps to the world's targets.
        index: (B,) int64, the environments that begin anew.
        env_count: N.

    Raises:
        EnvError: an option is unknown or of the wrong type, or nothing in the world fits.
    """
    _check_names(options)
    asked = {name: options[name] for name in EPISODE_OPTIONS if options.get(name) is not None}
    if not asked:
        return None
    scene = _scenes(asked.get("scene"), world, env_count)[index]
    first = world.scene_offset.numpy()
    target_scene, target_state = world.target_scene.numpy(), world.target_state.numpy()
    allowed = target_scene == scene[:, None]
    if "target" in asked:
        target = _states("target", asked["target"], env_count)[index]
        allowed &= target_state - first[target_scene] == target[:, None]
        _check_rows(allowed, target, scene, world, "is not a target of", "Its targets: ")
    if "start" not in asked:
        return EpisodeChoice(allowed, None)
    start = _states("start", asked["start"], env_count)[index]
    _check_range(start, scene, world)
    start = start + first[scene]
    allowed &= (distances[torch.arange(world.target_count), torch.from_numpy(start)[:, None]] > 0).numpy()
    _check_rows(allowed, start - first[scene], scene, world, "as start reaches no (other) target of", "Targets: ")
    return EpisodeChoice(allowed, start)


def _check_names(options: Mapping[str, Any]) -> None:
    known = (*EPISODE_OPTIONS, RESET_MASK)
    for name in options:
        if name not in known:
            raise EnvError(f"options[{name!r}] is unknown. Known options: {', '.join(known)}")


def _scenes(value: str | Sequence[str] | None, world: World, env_count: int) -> np.ndarray:
    """(N,) int64, the scene asked for, or the only one."""
    if value is None:
        if world.scene_count > 1:
            have = ", ".join(world.scene_names)
            raise EnvError(f"options: the state could be of several scenes. Add 'scene', one of {have}")
        return np.zeros(env_count, np.int64)
    names = [value] * env_count if isinstance(value, str) else value
    if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
        raise EnvError(f"options['scene']: expected a name, or one for each of the {env_count}, got {value!r}")
    if len(names) != env_count:
        raise EnvError(f"options['scene']: expected a name, or one for each of the {env_count}, got {len(names)}")
    for name in names:
        if name not in world.scene_names:
            have = ", ".join(world.scene_names)
            raise EnvError(f"options['scene']: {name!r} is not in this environment. Its scenes: {have}")
    return np.array([world.scene_names.index(name) for name in names])


def _states(option: str, value: object, env_count: int) -> np.ndarray:
    """(N,) int64."""
    states = as_array(value)
    fits = np.issubdtype(states.dtype, np.integer) and states.shape in ((), (env_count,))
    if not fits or states.max(initial=0) > np.iinfo(np.int64).max:
        raise EnvError(f"options['{option}']: expected a state id, or one for each of the {env_count}, got {value!r}")
    return np.broadcast_to(states.astype(np.int64), env_count)


def _check_range(start: np.ndarray, scene: np.ndarray, world: World) -> None:
    count = world.scene_offset.diff().numpy()[scene]
    wrong = (start < 0) | (start >= count)
    if wrong.any():
        row = int(wrong.argmax())
        name = world.scene_names[scene[row]]
        raise EnvError(f"options['start']: state {start[row]} is not in {name}. Its states are 0 to {count[row] - 1}")


def _check_rows(
    allowed: np.ndarray, state: np.ndarray, scene: np.ndarray, world: World, problem: str, remedy: str
) -> None:
    """Raise where a row (B, M) allows no target; state and scene (B,) are what was asked for."""
    if not allowed.any(1).all():
        row = int(allowed.any(1).argmin())
        targets = [world.scene_state(i) for i in np.flatnonzero(world.target_scene.numpy() == scene[row]).tolist()]
        names = f"state {state[row]} {problem} {world.scene_names[scene[row]]}"
        raise EnvError(f"options: {names}. {remedy}{', '.join(map(str, targets))}")
