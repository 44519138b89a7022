"""`LiveImageGoalVectorEnv`: N agents in one room off the grid, whose pictures are taken together."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from clearway.choices import HELD_OUT
from clearway.envs.arguments import (
    NO_LIMIT,
    RESET_MASK,
    Seeds,
    check_numbers,
    checked_actions,
    chosen_autoreset,
    environments_to_reset,
    seed_words,
)
from clearway.errors import EnvError
from clearway.live.conditions import REARRANGING
from clearway.live.walker import success_radius_m
from clearway.live_envs.arguments import (
    CLEARANCE,
    LIVE_RENDER_MODES,
    PerturbationSource,
    RoomSource,
    check_switches,
    check_workers,
    checked_drives,
    checked_ends,
    checked_number,
    checked_perturbations,
    checked_sensors,
    checked_targets,
    opened_room,
)
from clearway.live_envs.episode import End, EpisodePlan, Episodes, LiveEpisode, Rules
from clearway.live_envs.eyes import Eyes, Pictures
from clearway.live_envs.spaces import sensor_keys, space_of
from clearway.reward import Reward, reward_named
from clearway.rooms.camera import first_person_shot
from clearway.rooms.detail import are_small
from clearway.scenes.actions import ACTION_COUNT
from clearway.scenes.sensors import RGB

Observation = dict[str, np.ndarray]
Info = dict[str, Any]
Asked = tuple[list[int], list[int], dict[str, Pictures]]
"""Environments that look, those among them that begin, and what they will have seen."""

SUCCESS_DEG = 30.0
HEIGHT_PX, WIDTH_PX = 96, 128
FARTHEST_M, ONCE_ROUND_DEG = 10.0, 360.0  # of a move and of a turn
EPISODE_OPTIONS = ("target", "start")


class LiveImageGoalVectorEnv(VectorEnv[Observation, np.ndarray, np.ndarray]):
    """N agents side by side in one room, each walking to the pose where its target picture was taken.

    The batched `clearway.live_envs.single.LiveImageGoalEnv`, step for step the same; its docstring describes actions,
    observations, rewards, starting states and episode ends. Moves are made one by one, and all pictures are taken
    together, by `workers` processes that share the room.

    ## Action Space
    `MultiDiscrete([4] * N)`, with `stop=True` `MultiDiscrete([5] * N)`, with `continuous=True` `Box(-1, 1, (N, 2))`.

    ## Observation Space
    That of the single environment with a leading axis N.

    ## Rewards
    (N,) float64. In the mode NEXT_STEP the step that resets an environment earns 0.

    ## Starting State
    Environment i has a random stream of its own: `reset(seed=s)` seeds it with s + i, a sequence of seeds with its own
    (None: its stream goes on), and it then lives through the same episodes in a batch of any size.

    ## Episode End
    All of Gymnasium's autoreset modes, as of `clearway.envs.vector.ImageGoalVectorEnv`.

    ## Information
    Arrays (N,) of what the single environment tells, each with a bool mask `_key`.

    ## Arguments
    Those of `LiveImageGoalEnv`; `num_envs`, `autoreset_mode`, and `workers`, renderer processes for each camera (None:
    one a core; 16 at most). `reset` takes `options={"target": ..., "start": ..., "reset_mask": mask}`, all optional; a
    target or start is one for all environments or one for each. Of three environments, three whole numbers are three
    states, and a pose has a decimal point: (1.0, 2.0, 90.0). What `reset` refuses leaves everything as it was.

    ## Version History
    * v0: first version.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (Gymnasium's protocol)
        "render_modes": list(LIVE_RENDER_MODES),
        "render_fps": 4,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        room: RoomSource,
        *,
        room_seed: int = 0,
        targets: Sequence[int] | str | None = None,
        reward: str | Reward = "collision-aware",
        sensors: Sequence[str] = (RGB,),
        height_px: int = HEIGHT_PX,
        width_px: int = WIDTH_PX,
        continuous: bool = False,
        stop: bool = False,
        step_m: float | None = None,
        turn_deg: float | None = None,
        success_m: float | None = None,
        success_deg: float = SUCCESS_DEG,
        perturbations: PerturbationSource = None,
        history_length: int | None = None,
        max_episode_steps: int | None = None,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        workers: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        check_numbers(num_envs, 1 if history_length is None else history_length, max_episode_steps, None)
        self.autoreset_mode = chosen_autoreset(autoreset_mode)
        self._sensors = checked_sensors(sensors, height_px, width_px)
        check_switches(continuous, stop, render_mode, self._sensors)
        check_workers(workers)
        if step_m is not None:
            checked_number("step_m", step_m, FARTHEST_M)
        if turn_deg is not None:
            checked_number("turn_deg", turn_deg, ONCE_ROUND_DEG)
        earned, perturbed = reward_named(reward), checked_perturbations(perturbations)
        if success_m is not None:
            checked_number("success_m", success_m, FARTHEST_M)
        checked_number("success_deg", success_deg, 180.0)

        moving = any(getattr(perturbed, name) for name in REARRANGING)
        live = opened_room(room, room_seed, small=are_small(height_px, width_px), loose=moving)
        rules = Rules(
            earned,
            step_m=float(live.scene.cell_size_m if step_m is None else step_m),
            turn_deg=float(live.scene.turn_deg if turn_deg is None else turn_deg),
            success_m=float(success_radius_m(live.scene.cell_size_m) if success_m is None else success_m),
            success_deg=float(success_deg),
            stop=stop,
            perturbations=perturbed,
        )
        self.num_envs, self.render_mode = num_envs, render_mode
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}
        self.live, self._continuous, self._stop = live, continuous, stop
        self._limit = None if max_episode_steps == NO_LIMIT else max_episode_steps
        held_out = isinstance(targets, str) and targets == HELD_OUT
        named = None if held_out else checked_targets(targets)
        self._episodes = Episodes(live, rules, live.possible_targets(held_out) if named is None else named)
        cameras = [sensor for sensor in self._sensors if sensor.name != CLEARANCE]
        self._eyes = Eyes(live, cameras, workers)

        self._history = history_length or 1
        leading = () if history_length is None else (history_length,)
        self.single_observation_space = space_of(self._sensors, leading)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        actions = ACTION_COUNT + stop
        self.single_action_space = spaces.Box(-1, 1, (2,), np.float32) if continuous else spaces.Discrete(actions)
        self.action_space = batch_space(self.single_action_space, num_envs)

        self._streams = [np.random.default_rng() for _ in range(num_envs)]
        self._running: list[LiveEpisode | None] = [None] * num_envs
        self._elapsed = np.zeros(num_envs, np.int64)
        self._ended = np.zeros(num_envs, bool)
        # (N, K, ...) of the poses and (N, ...) of the targets, by the observation's keys
        self._poses = {sensor_keys(s)[0]: np.zeros((num_envs, self._history, *s.shape), s.dtype) for s in self._sensors}
        self._goals = {sensor_keys(s)[1]: np.zeros((num_envs, *s.shape), s.dtype) for s in cameras}
        self._stacked = history_length is not None

    @property
    def scene_names(self) -> tuple[str, ...]:
        """Name of the one room, as `info["scene"]` counts."""
        return (self.live.scene.name,)

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Observation, Info]:
        """Begin new episodes: everywhere, or in the environments of `options["reset_mask"]`.

        Raises:
            EnvError: a seed or an option that does not fit.
            ResetNeeded: the first reset leaves environments out.
        """
        options = options or {}
        for name in options:
            if name not in (*EPISODE_OPTIONS, RESET_MASK):
                known = ", ".join((*EPISODE_OPTIONS, RESET_MASK))
                raise EnvError(f"options[{name!r}] is unknown. Known options: {known}")
        index = environments_to_reset(options, self.num_envs)
        if None in self._running and len(index) < self.num_envs:
            raise ResetNeeded("the first reset has to begin all environments: call reset() without a reset_mask")
        streams = {env: deepcopy(self._streams[env]) for env in index.tolist()}
        if seed is not None:
            words, given = seed_words(seed, self.num_envs)
            streams |= {env: np.random.default_rng(int(words[env]) % 2**64) for env in index[given[index]].tolist()}
        asked = {
            name: checked_ends(name, options[name], self.num_envs)
            for name in EPISODE_OPTIONS
            if options.get(name) is not None
        }
        plans = {
            env: self._planned(stream, **{name: ends[env] for name, ends in asked.items()})
            for env, stream in streams.items()
        }
        if seed is not None:  # nothing can be wrong from here on
            super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)
        for env, plan in plans.items():
            self._streams[env] = streams[env]
            self._begin(env, plan)
        begun = np.zeros(self.num_envs, bool)
        begun[index] = True
        self._look(begun, begun)
        nothing = np.zeros(self.num_envs, bool)
        return self._observation(), self._info(nothing, nothing, begun)

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Info]:
        """Move every agent by its action: (N,) integers, or (N, 2) speeds and turn rates.

        Raises:
            EnvError: the actions are of another shape or type, or out of range.
            ResetNeeded: before the first reset, and in the mode DISABLED where an episode is over.
        """
        if self._continuous:
            chosen: list[Any] = list(checked_drives(actions, self.num_envs))
        else:
            chosen = checked_actions(actions, self.num_envs, ACTION_COUNT + self._stop).tolist()
        self._check_ready()
        resting = self._ended.copy()  # all False but in the mode NEXT_STEP: these reset now, actions are ignored
        reward = np.zeros(self.num_envs)
        terminated, contact, success = (np.zeros(self.num_envs, bool) for _ in range(3))
        asked = []  # pictures are taken while others move
        for envs in self._eyes.shares(list(range(self.num_envs))):
            for env in envs:
                if resting[env]:
                    self._begin(env)
                    continue
                done = self._episode(env).step(chosen[env])
                self._elapsed[env] += 1
                reward[env], terminated[env] = done.reward, done.ended
                contact[env], success[env] = done.contact, done.success
            asked.append(self._asked(envs, resting))
        self._see(asked, resting)
        limit_met = False if self._limit is None else self._elapsed >= self._limit
        truncated = np.asarray(limit_met & ~terminated & ~resting)
        everywhere = np.ones(self.num_envs, bool)
        ended, info = terminated | truncated, Info()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            info = self._final(contact, success, ended)
            for env in np.flatnonzero(ended).tolist():
                self._begin(env)
            self._look(ended, ended)
            contact, success = contact & ~ended, success & ~ended
        elif self.autoreset_mode is not AutoresetMode.SAME_STEP:
            self._ended = ended
        info |= self._info(contact, success, everywhere)
        return self._observation(), reward, terminated, truncated, info

    def render(self) -> tuple[np.ndarray, ...] | None:
        """What each agent sees, beside its target: one picture (height, 2 width, 3) uint8 an environment."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() without a render_mode. Give one when the environment is made")
            return None
        if None in self._running:
            raise ResetNeeded("render() before the first reset: call reset()")
        poses, goals = (seen[key] for seen, key in zip((self._poses, self._goals), sensor_keys(RGB), strict=True))
        return tuple(np.concatenate([seen[-1], goal], axis=1) for seen, goal in zip(poses, goals, strict=True))

    def close_extras(self, **kwargs: Any) -> None:
        """End the renderer processes."""
        self._eyes.close()

    def _episode(self, env: int) -> LiveEpisode:
        episode = self._running[env]
        assert episode is not None
        return episode

    def _check_ready(self) -> None:
        if None in self._running:
            raise ResetNeeded("step() before the first reset: call reset()")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            over = np.flatnonzero(self._ended).tolist()
            remedy = "call reset(), in a vector environment with options={'reset_mask': mask}"
            raise ResetNeeded(f"the episodes of environments {over} are over: {remedy}")

    def _planned(self, stream: np.random.Generator, target: End | None = None, start: End | None = None) -> EpisodePlan:
        return self._episodes.planned(int(stream.integers(2**63)), target=target, start=start)

    def _begin(self, env: int, plan: EpisodePlan | None = None) -> None:
        """Begin an episode as planned, else one drawn from the environment's stream."""
        plan = plan or self._planned(self._streams[env])
        self._running[env] = self._episodes.begin(plan, last=self._running[env])
        self._elapsed[env], self._ended[env] = 0, False

    def _look(self, where: np.ndarray, begun: np.ndarray) -> None:
        """Let the agents in where (N,) bool see; those in begun (N,), among them, see their target too."""
        looking = self._eyes.shares(np.flatnonzero(where).tolist())
        self._see([self._asked(envs, begun) for envs in looking], begun)

    def _asked(self, envs: list[int], begun: np.ndarray) -> Asked:
        """Ask for what some agents see, and for the targets of those that begin; `_see` waits for it."""
        moving = self._episodes.moving
        anew = [env for env in envs if begun[env]]
        shots = [self._episode(env).shot(self.live.camera_m, moving) for env in envs]
        unmoved_m = self._episodes.as_built.bodies_m if moving else ()
        for env in anew:
            target = self._episode(env).target
            shots.append(first_person_shot(*target, height_m=self.live.camera_m, moved_m=unmoved_m))
        return envs, anew, self._eyes.ask(shots)

    def _see(self, asked: list[Asked], begun: np.ndarray) -> None:
        """Let agents see what was asked for."""
        for envs, anew, pictures in asked:
            for sensor in self._sensors:
                pose_key, goal_key = sensor_keys(sensor.name)
                poses = self._poses[pose_key]
                if sensor.name == CLEARANCE:
                    seen = np.array([[self._episode(env).clearance_m] for env in envs], sensor.dtype)
                else:
                    taken = pictures[sensor.name]()
                    seen = taken[: len(envs)]
                    if anew:
                        self._goals[goal_key][anew] = taken[len(envs) :]
                for env, now in zip(envs, seen, strict=True):
                    now = self._episode(env).draws.seen(now) if sensor.name == RGB else now
                    poses[env, :-1] = poses[env, 1:]
                    poses[env, slice(None) if begun[env] else -1] = now

    def _observation(self) -> Observation:
        poses = self._poses if self._stacked else {key: seen[:, -1] for key, seen in self._poses.items()}
        return {key: seen.copy() for key, seen in sorted((poses | self._goals).items())}

    def _info(self, contact: np.ndarray, success: np.ndarray, where: np.ndarray) -> Info:
        """The info of the environments in where (N,) bool; zeros elsewhere, as Gymnasium fills them."""
        episodes = [self._episode(env) for env in range(self.num_envs)]
        origin = np.array([*self.live.origin_m, 0.0])
        pose = np.array([episode.walker.pose for episode in episodes]) + origin
        target = np.array([episode.target for episode in episodes]) + origin
        values = {
            "collision": contact,
            "cost": contact.astype(np.float64),
            "success": success,
            "zone": np.array([int(episode.zone) for episode in episodes]),
            "clearance_m": np.array([episode.clearance_m for episode in episodes]),
            "distance_m": np.array([episode.distance_m for episode in episodes]),
            "scene": np.zeros(self.num_envs, np.int64),
        }
        for name, poses in (("", pose), ("target_", target)):
            for part, values_of_part in zip(("x_m", "z_m", "heading_deg"), poses.T, strict=True):
                values[f"{name}{part}"] = values_of_part
        info: Info = {}
        for key, value in values.items():
            info[key] = np.where(where, value, np.zeros_like(value))
            info[f"_{key}"] = where.copy()
        return info

    def _final(self, contact: np.ndarray, success: np.ndarray, ended: np.ndarray) -> Info:
        """What the episodes ended with, in the form of Gymnasium's SyncVectorEnv."""
        last = self._observation()
        final_obs = np.full(self.num_envs, None, dtype=object)
        for env in np.flatnonzero(ended):  # an array of objects can only be filled one by one
            final_obs[env] = {key: value[env] for key, value in last.items()}
        final_info = self._info(contact, success, ended)
        return {"final_obs": final_obs, "_final_obs": ended.copy(), "final_info": final_info, "_final_info": ended}
