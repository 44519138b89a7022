"""`make_env`."""

from __future__ import annotations

import inspect
from typing import Any

import gymnasium
from gymnasium.vector import VectorEnv

from clearway.api.arguments import as_whole
from clearway.api.scenes import Scenes, load_scenes
from clearway.envs.registration import ENV_ID
from clearway.errors import ArgumentError


def make_env(scenes: Scenes, num_envs: int | None = None, **options: Any) -> gymnasium.Env | VectorEnv:
    """An environment of Gymnasium's, as `gymnasium.make("Clearway/ImageGoal-v0")` gives it; or a batch of them.

    Args:
        scenes: a scene, a scene file, a folder of them, or several.
        num_envs: None gives a single environment, a number a vector environment of so many.
        options: `targets`, `reward`, `observations`, `sensors`, `max_episode_steps` (500 by default), `history_length`,
            `zone_level`, `render_mode`, and of a batch `autoreset_mode`; see `clearway.envs.single.ImageGoalEnv`.

    Raises:
        ArgumentError: there is no such option, or an argument is of the wrong kind.
        ClearwayError: a value does not fit, or a scene cannot be read.
    """
    from clearway.envs.single import ImageGoalEnv
    from clearway.envs.vector import ImageGoalVectorEnv

    kind = ImageGoalEnv if num_envs is None else ImageGoalVectorEnv
    known = [name for name in inspect.signature(kind.__init__).parameters if name not in ("self", "scenes", "num_envs")]
    for name in options:
        if name not in known:
            raise ArgumentError(f"{name}: no such option of this environment. Use one of {', '.join(known)}")
    loaded = load_scenes(scenes)
    if num_envs is None:
        return gymnasium.make(ENV_ID, scenes=loaded, **options)
    return gymnasium.make_vec(ENV_ID, num_envs=as_whole("num_envs", num_envs, 1), scenes=loaded, **options)
