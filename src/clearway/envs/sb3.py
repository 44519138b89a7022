"""The batched environment in the form that Stable-Baselines3 wants: `SB3VecEnv`. Needs the extra `sb3`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv

from clearway.envs.vector import ImageGoalVectorEnv, Observation
from clearway.errors import EnvError, install_hint

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise EnvError(f"clearway.envs.sb3 needs Stable-Baselines3. {install_hint('sb3')}") from error


class SB3VecEnv(VecEnv):
    """`ImageGoalVectorEnv` as a Stable-Baselines3 `VecEnv`, without a loop over environments.

    Ended episodes begin anew in the same step. The info of an environment holds `collision`, `cost` (1.0 on a blocked
    move), and where its episode ended `terminal_observation` and `TimeLimit.truncated`, from which SB3 bootstraps.

    Args:
        scenes: as of `ImageGoalVectorEnv`; or a vector environment of ours in the autoreset mode SAME_STEP, such as a
            `LiveImageGoalVectorEnv`, with settings of its own.
        num_envs: environments side by side.
        scene_in_observation: add the scene's index, (1,) float32, as `scene`, for policies with a head a scene.
        **settings: others of `ImageGoalVectorEnv`.
    """

    def __init__(self, scenes: Any, *, num_envs: int = 1, scene_in_observation: bool = False, **settings: Any) -> None:
        self.envs = _made(scenes, num_envs=num_envs, **settings)
        num_envs = self.envs.num_envs
        self.scene_in_observation = scene_in_observation
        seen = self.envs.single_observation_space
        assert isinstance(seen, spaces.Dict)
        if scene_in_observation:
            seen = spaces.Dict({**seen.spaces, "scene": scene_space(len(self.envs.scene_names))})
        super().__init__(num_envs, seen, self.envs.single_action_space)
        self._actions = np.zeros(num_envs, np.int64)

    def reset(self) -> Observation:
        """Begin all episodes, with the seeds of `seed` and the options of `set_options`, which count once.

        Raises:
            EnvError: an option does not fit, or is given for some environments alone.
        """
        seeds = [None if seed is None else int(seed) for seed in self._seeds]
        seen, info = self.envs.reset(seed=seeds, options=_joined(self._options))
        self._reset_seeds()
        self._reset_options()
        told = {name: values for name, values in info.items() if not name.startswith("_")}
        self.reset_infos = [{name: values[env] for name, values in told.items()} for env in range(self.num_envs)]
        return self._with_scene(seen, info["scene"])

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions (N,) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Observation, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step all: observations, rewards (N,) float32, ends (N,) bool, infos."""
        seen, reward, terminated, truncated, info = self.envs.step(self._actions)
        ended = terminated | truncated
        collision = info["collision"]
        if ended.any():  # what the last step of an episode did stands in its final info
            collision = np.where(ended, info["final_info"]["collision"], collision)
        infos: list[dict[str, Any]] = [{"collision": hit, "cost": float(hit)} for hit in collision.tolist()]
        for env in np.flatnonzero(ended).tolist():
            last = self._with_scene(info["final_obs"][env], info["final_info"]["scene"][env])
            infos[env]["terminal_observation"] = last
            infos[env]["TimeLimit.truncated"] = bool(truncated[env] and not terminated[env])
        return self._with_scene(seen, info["scene"]), reward.astype(np.float32), ended, infos

    def _with_scene(self, seen: Observation, scene: np.ndarray) -> Observation:
        return {**seen, "scene": np.asarray(scene, np.float32)[..., None]} if self.scene_in_observation else seen

    def close(self) -> None:
        """Close the environments."""
        self.envs.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of each environment, if made with render_mode "rgb_array"."""
        return list(self.envs.render() or [None] * self.num_envs)

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """The attribute, once for each environment asked for."""
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Set the attribute for all."""
        setattr(self.envs, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: int | Iterable[int] | None = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call the method once, for all; its result, once for each environment asked for."""
        result = getattr(self.envs, method_name)(*method_args, **method_kwargs)
        return [result] * len(list(self._get_indices(indices)))

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper], indices: int | Iterable[int] | None = None
    ) -> list[bool]:
        """Never."""
        return [False] * len(list(self._get_indices(indices)))


def _made(scenes: Any, num_envs: int, **settings: Any) -> Any:
    """A vector environment as it is, or one of the scenes.

    Raises:
        EnvError: one that is made already has another number or way of beginning episodes, or is given settings.
    """
    if not isinstance(scenes, VectorEnv):
        return ImageGoalVectorEnv(scenes, num_envs=num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **settings)
    if settings or num_envs not in (1, scenes.num_envs):
        given = ", ".join(settings) or f"num_envs={num_envs}"
        raise EnvError(f"{given}: these environments are made already. Leave that out, or give scenes")
    if scenes.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
        raise EnvError(
            "these environments begin episodes in a step of their own. Make them with autoreset_mode='SameStep'"
        )
    return scenes


def _joined(options: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Each environment's options as one mapping to a value an environment."""
    names = options[0].keys()
    for own in options:
        if own.keys() != names:
            raise EnvError(f"options: {list(own)} and {list(names)}. Give all environments the same options")
    return {name: [own[name] for own in options] for name in names}


def scene_space(scene_count: int) -> spaces.Box:
    """Space of the scene's index, as a policy gets it."""
    return spaces.Box(0, max(scene_count - 1, 1), (1,), np.float32)
