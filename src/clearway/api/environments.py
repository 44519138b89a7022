"""`make_env`."""

from __future__ import annotations

import inspect
from numbers import Integral
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.vector import VectorEnv

from clearway.api.arguments import as_whole, as_word
from clearway.api.scenes import Scenes, load_scenes
from clearway.choices import MODEL_SUFFIXES
from clearway.envs.arguments import NO_LIMIT
from clearway.envs.registration import ENV_ID, LIVE_ENV_ID
from clearway.errors import ArgumentError
from clearway.rooms import ROOM_NAMES
from clearway.scenes.scene import Scene


def make_env(
    scenes: Scenes, num_envs: int | None = None, *, live: bool = False, **options: Any
) -> gymnasium.Env | VectorEnv:
    """An environment of Gymnasium's, as `gymnasium.make("Clearway/ImageGoal-v0")` gives it; or a batch of them.

    Args:
        scenes: a scene, a scene file, a folder of them, or several. Live: one of them, the name of a room of ours,
            or a MuJoCo model's file.
        num_envs: None gives a single environment, a number a vector environment of so many.
        live: walk in the room itself, at any pose, with pictures rendered on the way: `Clearway/LiveImageGoal-v0`.
        options: `targets`, `reward`, `observations`, `sensors`, `max_episode_steps` (500 by default), `history_length`,
            `zone_level`, `render_mode`, and of a batch `autoreset_mode`; see `clearway.envs.single.ImageGoalEnv`. Those
            of a live one: `clearway.live_envs.single.LiveImageGoalEnv`.

    Raises:
        ArgumentError: there is no such option, or an argument is of the wrong kind.
        ClearwayError: a value does not fit, or a scene cannot be read.
    """
    if not isinstance(live, bool):
        raise ArgumentError(f"live={live!r:.40}: expected True or False")
    kind, env_id, first = _live_kind(num_envs) if live else _kind(num_envs)
    known = [name for name in inspect.signature(kind.__init__).parameters if name not in ("self", first, "num_envs")]
    for name in options:
        if name not in known:
            raise ArgumentError(f"{name}: no such option of this environment. Use one of {', '.join(known)}")
    steps, mode = options.get("max_episode_steps"), options.get("render_mode")
    if steps is not None:  # Gymnasium looks at both first, in words of its own
        no_limit = isinstance(steps, Integral) and steps == NO_LIMIT
        options["max_episode_steps"] = NO_LIMIT if no_limit else as_whole("max_episode_steps", steps, 1)
    if mode is not None:
        as_word("render_mode", mode)
    options[first] = _room(scenes) if live else load_scenes(scenes)
    if num_envs is None:
        return gymnasium.make(env_id, **options)
    return gymnasium.make_vec(env_id, num_envs=as_whole("num_envs", num_envs, 1), **options)


def _kind(num_envs: int | None) -> tuple[Any, str, str]:
    """Class, id and first argument of an environment on the grid."""
    from clearway.envs.single import ImageGoalEnv
    from clearway.envs.vector import ImageGoalVectorEnv

    return ImageGoalEnv if num_envs is None else ImageGoalVectorEnv, ENV_ID, "scenes"


def _live_kind(num_envs: int | None) -> tuple[Any, str, str]:
    """The same off the grid."""
    from clearway.live_envs.single import LiveImageGoalEnv
    from clearway.live_envs.vector import LiveImageGoalVectorEnv

    return LiveImageGoalEnv if num_envs is None else LiveImageGoalVectorEnv, LIVE_ENV_ID, "room"


def _room(source: Scenes) -> str | Path | Scene:
    """The name of one of our rooms, a MuJoCo model's file, or a scene."""
    if isinstance(source, str) and source in ROOM_NAMES:
        return source
    if isinstance(source, (str, Path)) and Path(source).suffix.lower() in MODEL_SUFFIXES:
        return source
    scene, *others = load_scenes(source)
    if others:
        raise ArgumentError(f"a live environment is one room, found {1 + len(others)} scenes. Name one")
    return scene
