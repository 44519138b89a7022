"""Checks of what users hand to the environments: scenes, reward, numbers, actions, seeds, masks. Without PyTorch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from clearway.choices import HELD_OUT
from clearway.envs.render import RENDER_MODES
from clearway.errors import EnvError
from clearway.remote.address import address_of, without_secrets
from clearway.scenes.actions import ACTION_COUNT
from clearway.scenes.scene import Scene
from clearway.scenes.scene_files import scene_files
from clearway.scenes.targets import default_held_out_targets, default_targets

SceneSource = Scene | str | Path
Seeds = int | Sequence[int | None] | np.ndarray | None
RESET_MASK = "reset_mask"
NO_LIMIT = -1  # how gymnasium.make spells it; None means the same


def loaded_scenes(scenes: SceneSource | Sequence[SceneSource]) -> list[Scene]:
    """The scenes themselves, or read from their files."""
    sources = [scenes] if isinstance(scenes, (Scene, str, Path)) or not isinstance(scenes, Iterable) else list(scenes)
    if not sources:
        raise EnvError("scenes is empty. Give at least one scene or scene file")
    for source in sources:
        if not isinstance(source, (Scene, str, Path)):
            raise EnvError(f"scenes: {source!r:.80} is neither a scene nor a file's path. Give one of them, or several")
    return [source if isinstance(source, Scene) else scene_of_file(source) for source in sources]


def scene_of_file(path: str | Path) -> Scene:
    """The scene of a file, which may lie elsewhere.

    Raises:
        ClearwayError: it is no scene, or cannot be had.
    """
    from clearway.scenes.thor_v1 import read_scene

    if (address := address_of(path)) is None:
        return read_scene(Path(path))
    found = scene_files([Path(path)])
    if len(found) > 1:
        raise EnvError(f"{without_secrets(address)}: a folder of {len(found)} scenes. Name one file in it")
    return read_scene(found[0])


def check_numbers(num_envs: int, history_length: int, max_episode_steps: int | None, render_mode: str | None) -> None:
    """Raise EnvError where one of them is out of range, or no whole number."""
    numbers = {"num_envs": num_envs, "history_length": history_length, "max_episode_steps": max_episode_steps}
    for name, number in numbers.items():
        if not isinstance(number, (int, np.integer)) and (number is not None or name != "max_episode_steps"):
            raise EnvError(f"{name}={number!r}: expected a whole number")
    if num_envs < 1:
        raise EnvError(f"num_envs={num_envs}: expected at least 1 environment")
    if history_length < 1:
        raise EnvError(f"history_length={history_length}: expected at least 1 pose")
    if max_episode_steps is not None and max_episode_steps != NO_LIMIT and max_episode_steps < 1:
        raise EnvError(f"max_episode_steps={max_episode_steps}: expected at least 1 step, or None for no limit")
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise EnvError(f"render_mode={render_mode!r} is unknown. Use one of {', '.join(RENDER_MODES)}, or None")


def check_switch(name: str, value: object) -> None:
    """Raise EnvError where a value is neither True nor False."""
    if not isinstance(value, (bool, np.bool_)):
        raise EnvError(f"{name}={value!r:.40}: expected True or False")


def chosen_targets(
    targets: Mapping[str, Sequence[int]] | Sequence[int] | str | None, scenes: Sequence[Scene]
) -> dict[str, Sequence[int]]:
    """Targets by scene name, or alone for a single scene; the scenes' default ones for None, for "held-out" such ones.

    Raises:
        EnvError: they are nothing of the kind.
        SceneError: nothing is held out in a scene.
    """
    if isinstance(targets, str) and targets == HELD_OUT:
        return {scene.name: default_held_out_targets(scene) for scene in scenes}
    if targets is None:
        return {scene.name: default_targets(scene) for scene in scenes}
    if not isinstance(targets, Mapping):
        if isinstance(targets, str) or not isinstance(targets, Iterable) or len(scenes) > 1:
            expected = "expected state ids by scene name, such as {'bathroom': [26, 37]}"
            raise EnvError(f"targets={targets!r:.80}: {expected}; of one scene a list will do")
        targets = {scenes[0].name: targets}
    for name, states in targets.items():
        if isinstance(states, str) or not isinstance(states, Iterable):
            raise EnvError(f"targets[{name!r}]={states!r:.80}: expected state ids, such as [26, 37]")
    return {name: list(states) for name, states in targets.items()}


def chosen_autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    """The mode itself, or the one of that name; EnvError where there is none."""
    try:
        return AutoresetMode(mode)
    except ValueError as fault:
        names = ", ".join(str(one.value) for one in AutoresetMode)
        raise EnvError(f"autoreset_mode={mode!r} is unknown. Use one of {names}") from fault


def as_array(value: object) -> np.ndarray:
    """What is given as an array; of lists of several lengths one of objects."""
    try:
        return np.asarray(value)
    except ValueError:
        return np.asarray(None)


def checked_actions(actions: np.ndarray, env_count: int, action_count: int = ACTION_COUNT) -> np.ndarray:
    """The actions as (env_count,) int64; EnvError where they are no actions."""
    action = as_array(actions)
    if not np.issubdtype(action.dtype, np.integer) or action.shape != (env_count,):
        found = f"{action.dtype} of shape {action.shape}"
        raise EnvError(f"actions: expected integers of shape ({env_count},), found {found}. Take action_space.sample()")
    if action.min() < 0 or action.max() >= action_count:
        wrong = action[(action < 0) | (action >= action_count)][0]
        raise EnvError(f"action {wrong} is out of range. Actions are 0 to {action_count - 1}")
    return action.astype(np.int64)


def environments_to_reset(options: Mapping[str, Any], env_count: int) -> np.ndarray:
    """The environments that begin anew, (B,) int64: those of `options["reset_mask"]`, else all.

    Raises:
        EnvError: the mask is not a bool array (N,) with at least one True.
    """
    if RESET_MASK not in options:
        return np.arange(env_count)
    mask = options[RESET_MASK]
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (env_count,) or not mask.any():
        expected = f"a bool array of shape ({env_count},) with at least one True"
        raise EnvError(f"options['{RESET_MASK}']: expected {expected}, got {mask!r}")
    return np.flatnonzero(mask)


def seed_words(seed: int | Sequence[int | None] | np.ndarray, env_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Seeds (N,) int64 and which environments have one, (N,) bool.

    An int s means s, s + 1, ...; a sequence names each, None for none. Seeds count modulo 2^64.
    """
    array = isinstance(seed, np.ndarray) and seed.ndim == 1
    if not array and not isinstance(seed, (int, np.integer, Sequence)):
        raise EnvError(f"seed: expected an integer, or one for each of the {env_count} environments, got {seed!r}")
    seeds = [int(seed) + env for env in range(env_count)] if isinstance(seed, (int, np.integer)) else list(seed)
    if len(seeds) != env_count:
        raise EnvError(f"seed: expected one for each of the {env_count} environments, got {len(seeds)}")
    for one in seeds:
        if one is not None and (not isinstance(one, (int, np.integer)) or one < 0):
            raise EnvError(f"seed: expected integers from 0 on, got {one!r}")
    words = np.array([0 if one is None else int(one) % 2**64 for one in seeds], np.uint64).view(np.int64)
    return words, np.array([one is not None for one in seeds])
