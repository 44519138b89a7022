"""`ImageGoalVectorEnv`: Gymnasium's vector interface on `Navigation`, without a loop over environments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Discrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from clearway.choices import ZoneLevel
from clearway.envs.arguments import (
    NO_LIMIT,
    SceneSource,
    Seeds,
    check_numbers,
    check_switch,
    checked_actions,
    chosen_autoreset,
    chosen_targets,
    environments_to_reset,
    loaded_scenes,
    seed_words,
)
from clearway.envs.options import EpisodeChoice, episode_choice
from clearway.envs.record import EpisodeRecord
from clearway.envs.render import RENDER_MODES, Renderer
from clearway.envs.spaces import ObservationKind, observation_sources, observation_space
from clearway.reward import Reward, reward_named
from clearway.scenes.actions import ACTION_COUNT
from clearway.scenes.sensors import RGB
from clearway.world.navigation import HISTORY_LENGTH, Navigation, TargetChoice
from clearway.world.world import make_world

Observation = dict[str, np.ndarray]
Info = dict[str, Any]


class ImageGoalVectorEnv(VectorEnv[Observation, np.ndarray, np.ndarray]):
    """N agents side by side, each walking to the place where its target picture was taken.

    The batched `clearway.envs.single.ImageGoalEnv`, step for step the same; its docstring describes actions,
    observations, rewards, starting states and episode ends.

    ## Action Space
    `MultiDiscrete([4] * N)`: one action an agent; with `stop=True` `MultiDiscrete([5] * N)`.

    ## Observation Space
    `Dict(observation, target)`, and two boxes more for each further sensor, with a leading axis N.

    ## Rewards
    (N,) float64. In the mode NEXT_STEP the step that resets an environment earns 0.

    ## Starting State
    Environment i has random streams of its own: `reset(seed=s)` seeds it with s + i, a sequence of seeds with its own
    (None: its streams go on), and it then lives through the same episodes in a batch of any size. `reset()` without a
    seed goes on with the streams.

    ## Episode End
    All of Gymnasium's autoreset modes, by `autoreset_mode`:

    - NEXT_STEP (default): the step after the last resets the environment; its action is ignored.
    - SAME_STEP: the last step resets it; `info["final_obs"]` and `info["final_info"]` hold what the episode ended with.
    - DISABLED: reset ended environments with `reset(options={"reset_mask": mask})`, mask (N,) bool.

    ## Information
    Arrays (N,), each with a bool mask `_key` of the environments that it speaks of: `collision` (bool, the move was
    blocked), `cost` (1.0 where it was), `zone` (of the pose arrived in: 0 free, 1 precollision, 2 collision),
    `distance_to_go` (shortest-path steps to the target), `scene` (index in `scene_names`), `state` and `target` (state
    ids in the scene's own numbering).

    ## Arguments
    Those of `ImageGoalEnv`, and `num_envs` and `autoreset_mode`. `reset` takes `options={"scene": name, "target": id,
    "start": state, "reset_mask": mask}`, all optional, each for all environments or one value an environment.

    ## Version History
    * v0: first version.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (Gymnasium's protocol)
        "render_modes": list(RENDER_MODES),
        "render_fps": 4,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        scenes: SceneSource | Sequence[SceneSource],
        *,
        targets: Mapping[str, Sequence[int]] | str | None = None,
        reward: str | Reward = "collision-aware",
        observations: ObservationKind = "features",
        sensors: Sequence[str] = (RGB,),
        zone_level: ZoneLevel = "pose",
        max_episode_steps: int | None = None,
        history_length: int = HISTORY_LENGTH,
        stop: bool = False,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        check_numbers(num_envs, history_length, max_episode_steps, render_mode)
        check_switch("stop", stop)
        loaded = loaded_scenes(scenes)
        chosen = chosen_targets(targets, loaded)
        self.num_envs, self.render_mode = num_envs, render_mode
        self.autoreset_mode = chosen_autoreset(autoreset_mode)
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}

        seen = loaded if observations == "features" else [replace(scene, features=None) for scene in loaded]
        self._world = make_world(seen, chosen, zone_level)
        self._distances = self._world.distance_table()
        self._sources = observation_sources(loaded, observations, sensors, self._world)
        self.single_observation_space = observation_space(self._sources, history_length)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = Discrete(ACTION_COUNT + stop)
        self.action_space = batch_space(self.single_action_space, num_envs)

        self._navigation = Navigation(
            self._world,
            reward_named(reward),
            torch.from_numpy(np.random.default_rng().integers(2**63, size=num_envs)),
            step_limit=None if max_episode_steps == NO_LIMIT else max_episode_steps,
            history_length=history_length,
            reward_dtype=torch.float64,
            stop=stop,
        )
        self._started = False
        self._ended = np.zeros(num_envs, bool)
        self._record = EpisodeRecord(num_envs) if render_mode else None
        self._renderer = Renderer(loaded, self._world) if render_mode else None

    @property
    def scene_names(self) -> tuple[str, ...]:
        """Name of each scene, in the order of `info["scene"]`."""
        return self._world.scene_names

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Observation, Info]:
        """Begin new episodes: everywhere, or in the environments of `options["reset_mask"]`.

        Raises:
            EnvError: a seed or an option that does not fit.
            ResetNeeded: the first reset leaves environments out.
        """
        options = options or {}
        index = environments_to_reset(options, self.num_envs)
        if not self._started and len(index) < self.num_envs:
            raise ResetNeeded("the first reset has to begin all environments: call reset() without a reset_mask")
        choice = episode_choice(options, self._world, self._distances, index, self.num_envs)
        if seed is not None:
            seeds, given = seed_words(seed, self.num_envs)
            super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)
            seeded = index[given[index]]
            self._navigation.reseed(torch.from_numpy(seeds[seeded]), torch.from_numpy(seeded))
        self._begin(index, choice)
        self._started, self._ended[index] = True, False
        begun = np.zeros(self.num_envs, bool)
        begun[index] = True
        return self._observe(), self._info(np.zeros(self.num_envs, bool), begun)

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Info]:
        """Move every agent by its action, (N,) integers.

        Raises:
            EnvError: the actions are of another shape or type, or out of range.
            ResetNeeded: before the first reset, and in the mode DISABLED where an episode is over.
        """
        action = checked_actions(actions, self.num_envs, ACTION_COUNT + self._navigation.stop)
        self._check_ready()
        resting = self._ended  # all False but in the mode NEXT_STEP: these reset now, their actions are ignored
        step = self._navigation.step(torch.from_numpy(action))
        reward = np.where(resting, 0.0, step.reward.numpy())
        terminated, truncated = (step.ended & ~step.truncated).numpy() & ~resting, step.truncated.numpy() & ~resting
        blocked = step.blocked.numpy() & ~resting
        if self._record:
            self._record.add(step.state.numpy(), action, blocked)
        self._begin(np.flatnonzero(resting))
        ended = terminated | truncated
        infos: Info = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            infos = self._final(blocked, ended)
            self._begin(np.flatnonzero(ended))
            blocked = blocked & ~ended
        else:
            self._ended = ended
        everywhere = np.ones(self.num_envs, bool)
        return self._observe(), reward, terminated, truncated, infos | self._info(blocked, everywhere)

    def render(self) -> tuple[Any, ...] | None:
        """One picture (height, width, 3) uint8 an environment ("rgb_array"), or one string ("ansi")."""
        if self._record is None or self._renderer is None:
            gymnasium.logger.warn("render() without a render_mode. Give one when the environment is made")
            return None
        if not self._started:
            raise ResetNeeded("render() before the first reset: call reset()")
        target = self._navigation.target.tolist()
        ended = [self._record.episode(env) for env in range(self.num_envs)]
        draw = self._renderer.ansi if self.render_mode == "ansi" else self._renderer.rgb
        return tuple(draw(episode, goal) for episode, goal in zip(ended, target, strict=True))

    def _check_ready(self) -> None:
        if not self._started:
            raise ResetNeeded("step() before the first reset: call reset()")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            over = np.flatnonzero(self._ended).tolist()
            remedy = "call reset(), in a vector environment with options={'reset_mask': mask}"
            raise ResetNeeded(f"the episodes of environments {over} are over: {remedy}")

    def _begin(self, index: np.ndarray, choice: EpisodeChoice | None = None) -> None:
        """Begin new episodes in the environments in index (B,)."""
        if not len(index):
            return
        where = torch.from_numpy(index)
        if choice is None:
            self._navigation.reset(where)
        else:
            start = None if choice.start is None else torch.from_numpy(choice.start)
            self._navigation.reset(where, self._draw_target(where, choice), start)
        if self._record:
            self._record.begin(index, self._navigation.state.numpy())

    def _draw_target(self, index: torch.Tensor, choice: EpisodeChoice) -> torch.Tensor:
        """Targets (B,) among those that the options allow, from the environments' own streams."""
        row = torch.arange(len(index))
        members = torch.arange(self._world.target_count).expand(len(index), -1)
        allowed = TargetChoice(row, members, torch.from_numpy(choice.allowed).double())
        return allowed.draw(self._navigation.target_stream.at(index), row)

    def _observe(self) -> Observation:
        history, target = self._navigation.history, self._world.target_state[self._navigation.target]
        states = torch.cat([history, target[:, None]], 1).numpy()  # (N, K + 1)
        observation = {}
        for (poses_key, target_key), source in self._sources.items():
            seen = source.read(states)  # (N, K + 1, ...)
            observation[poses_key] = np.ascontiguousarray(seen[:, :-1])
            observation[target_key] = np.ascontiguousarray(seen[:, -1])
        return observation

    def _info(self, collision: np.ndarray, where: np.ndarray) -> Info:
        """The info of the environments in where (N,) bool; zeros elsewhere, as Gymnasium fills them."""
        world, target, state = self._world, self._navigation.target, self._navigation.state
        scene = world.target_scene[target]
        first = world.scene_offset[scene]
        values = {
            "collision": collision,
            "cost": collision.astype(np.float64),
            "zone": world.zone[state].numpy(),
            "distance_to_go": self._distances[target, state].numpy(),
            "scene": scene.numpy(),
            "state": (state - first).numpy(),
            "target": (world.target_state[target] - first).numpy(),
        }
        info: Info = {}
        for key, value in values.items():
            info[key] = np.where(where, value, np.zeros_like(value))
            info[f"_{key}"] = where.copy()
        return info

    def _final(self, collision: np.ndarray, ended: np.ndarray) -> Info:
        """What the episodes ended with, in the form of Gymnasium's SyncVectorEnv; empty where none ended."""
        if not ended.any():
            return {}
        last = self._observe()
        final_obs = np.full(self.num_envs, None, dtype=object)
        for env in np.flatnonzero(ended):  # an array of objects can only be filled one by one
            final_obs[env] = {key: value[env].copy() for key, value in last.items()}
        final_info = self._info(collision, ended)
        return {
            "final_obs": final_obs,
            "_final_obs": ended.copy(),
            "final_info": final_info,
            "_final_info": ended.copy(),
        }
