"""`LiveImageGoalEnv`: Gymnasium's single environment off the grid, a batch of one of `LiveImageGoalVectorEnv`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from clearway.envs.arguments import RESET_MASK, as_array, seed_words
from clearway.errors import EnvError
from clearway.live_envs.arguments import LIVE_RENDER_MODES, PerturbationSource, RoomSource
from clearway.live_envs.vector import (
    HEIGHT_PX,
    SUCCESS_DEG,
    WIDTH_PX,
    Info,
    LiveImageGoalVectorEnv,
    Observation,
)
from clearway.reward import Reward
from clearway.scenes.sensors import RGB


class LiveImageGoalEnv(gymnasium.Env[Observation, Any]):
    """An agent walks in a furnished room, at any pose, to where a picture was taken.

    ## Description

    The room of `Clearway/ImageGoal-v0` without its grid: the agent is a standing capsule that MuJoCo moves until it
    touches something, and every picture is rendered where it stands. Moves and turns can be inexact, camera, light and
    furniture can differ from episode to episode (`perturbations`). Without perturbations, and with moves and turns of
    the default lengths, the agent stays on the grid until its first contact. In MuJoCo models of others nothing is
    moved: `move_furniture` and `new_obstacle` are refused there.

    ## Action Space

    `Discrete(4)`, or with `stop=True` `Discrete(5)`

    | Num | Action        |                                                                              |
    |-----|---------------|------------------------------------------------------------------------------|
    | 0   | move forward  | by `step_m`, more or less by `distance_noise`; up to the first contact       |
    | 1   | turn right    | by `turn_deg`, more or less by `angle_noise`                                 |
    | 2   | turn left     |                                                                              |
    | 3   | move backward |                                                                              |
    | 4   | stop          | ends the episode, which succeeds at the target                               |

    With `continuous=True` `Box(-1, 1, (2,))`: forward speed as a share of `step_m` a step, turn rate as a share of
    `turn_deg` a step, to the right where it is positive. Both at once are an arc; a contact ends the move and leaves
    the turn.

    ## Observation Space

    `Dict`, by the sensors that are asked for, with the keys of `Clearway/ImageGoal-v0`:

    | Sensor      | Key            | Shape       | Values                                                            |
    |-------------|----------------|-------------|-------------------------------------------------------------------|
    | `rgb`       | `observation`  | `(H, W, 3)` | uint8, what the agent sees                                        |
    |             | `target`       | `(H, W, 3)` | uint8, the picture to find the place of, in the room as built     |
    | `depth`     | `depth`        | `(H, W)`    | float32, metres                                                   |
    |             | `target_depth` | `(H, W)`    | float32, metres                                                   |
    | `clearance` | `clearance`    | `(1,)`      | float32, metres from the body to the nearest obstacle, at most 5  |

    Pictures of 160 x 200 pixels at most, and of even sides, are taken the fast way, of rooms in small detail: the same
    to the eye as those of scene files, not bit for bit. Larger ones and those of odd sides are the same bits.

    With `history_length=K` all but the targets' are of the last K poses, newest last, `(K, H, W, 3)` and so on.

    ## Rewards

    Those of `Clearway/ImageGoal-v0`, by the pose that a step ends in, with contacts for blocked moves: in the collision
    zone a move forward or backward from there would end in a contact, in the precollision zone one such move leads into
    the collision zone. In a grid's poses these are the grid's zones. The reward `clearance` goes by the measured
    distance between body and obstacle; on the grid it is that to the side of a blocked cell.

    A term of one's own finds what every action of the step earned in `Moves`: state 0 is the pose that was left, 1 the
    pose arrived in; stopping and continuous actions earn what moving forward does.

    `info["cost"]` is 1.0 on a contact and 0.0 otherwise.

    ## Starting State

    Start and target are drawn uniformly from the poses of the grid's largest connected part, the target from those that
    `targets` names, apart from each other by more than `success_m` or `success_deg`.
    `reset(options={"target": end, "start": end})` fixes either: a state id of the scene, or a pose (x, z, heading) in
    metres and degrees. A seed repeats all episodes, with their perturbations.

    ## Episode End

    1. Termination: the agent is within `success_m` and `success_deg` of the target. With `stop=True` instead: it stops,
       and `info["success"]` says whether that was at the target, which alone earns the target's reward.
    2. Truncation: after `max_episode_steps` steps (500 through `gymnasium.make`).

    ## Information

    `collision` (bool, the move ended in a contact), `cost`, `success` (bool), `zone` (0 free, 1 precollision, 2
    collision), `clearance_m`, `distance_m` (to the target, as the crow flies), `scene` (0), the pose as `x_m`, `z_m`,
    `heading_deg`, and the target's as `target_x_m`, `target_z_m`, `target_heading_deg`.

    ## Arguments

    | Parameter           | Default             | Description                                                          |
    |---------------------|---------------------|----------------------------------------------------------------------|
    | `room`              | required            | a room's name, a scene file or `Scene` that clearway built or        |
    |                     |                     | imported from a MuJoCo model, or such a model's file (.xml, .urdf)   |
    | `room_seed`         | `0`                 | of a room by name: another has other colours and small furniture     |
    | `targets`           | `None`              | state ids to draw targets from; None: all, of generated rooms and    |
    |                     |                     | flats those that are not held out; "held-out": those that are        |
    | `reward`            | `"collision-aware"` | or another of `reward.REWARDS`, a `Reward`, or package.module:name   |
    | `sensors`           | `("rgb",)`          | of `"rgb"`, `"depth"`, `"clearance"`; a camera among them            |
    | `height_px`         | `96`                | of a picture                                                         |
    | `width_px`          | `128`               | of a picture                                                         |
    | `continuous`        | `False`             | speed and turn rate instead of four actions                          |
    | `stop`              | `False`             | a fifth action ends the episode                                      |
    | `step_m`            | `None`              | length of a move; None: the grid's                                   |
    | `turn_deg`          | `None`              | angle of a turn; None: the grid's                                    |
    | `success_m`         | `None`              | so near has the agent arrived; None: 0.25, or half a cell if less    |
    | `success_deg`       | `30.0`              | looking so nearly the target's way                                   |
    | `perturbations`     | `None`              | `live.conditions.Perturbations`, or strengths by name                |
    | `max_episode_steps` | `None`              | steps until truncation; None for no limit (`make` sets 500)          |
    | `history_length`    | `None`              | K poses in an observation; None: one, without an axis                |
    | `render_mode`       | `None`              | `"rgb_array"`: view and target side by side                          |

    ```python
    >>> import gymnasium  # which knows it once clearway is installed
    >>> env = gymnasium.make("Clearway/LiveImageGoal-v0", room="bathroom")
    >>> envs = gymnasium.make_vec("Clearway/LiveImageGoal-v0", num_envs=8, room="bathroom")

    ```

    ## Version History

    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": list(LIVE_RENDER_MODES), "render_fps": 4}  # noqa: RUF012

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
        render_mode: str | None = None,
    ) -> None:
        self._batch = LiveImageGoalVectorEnv(
            room,
            room_seed=room_seed,
            targets=targets,
            reward=reward,
            sensors=sensors,
            height_px=height_px,
            width_px=width_px,
            continuous=continuous,
            stop=stop,
            step_m=step_m,
            turn_deg=turn_deg,
            success_m=success_m,
            success_deg=success_deg,
            perturbations=perturbations,
            history_length=history_length,
            max_episode_steps=max_episode_steps,
            autoreset_mode=AutoresetMode.DISABLED,
            workers=1,
            render_mode=render_mode,
        )
        self.render_mode = render_mode
        self.observation_space = self._batch.single_observation_space
        self.action_space = self._batch.single_action_space

    @property
    def scene_names(self) -> tuple[str, ...]:
        """Name of the one room, as `info["scene"]` counts."""
        return self._batch.scene_names

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, Info]:
        """Begin a new episode; see the class for `options`.

        Raises:
            EnvError: the seed is negative, or an option is unknown or does not fit.
        """
        if seed is not None:
            seed_words(seed, 1)  # before Gymnasium, which raises other errors
        super().reset(seed=int(seed) if isinstance(seed, (int, np.integer)) else None)  # it takes none of NumPy's
        if options and RESET_MASK in options:
            raise EnvError(f"options['{RESET_MASK}'] is for vector environments. Leave it out")
        observation, info = self._batch.reset(seed=seed, options=options)
        return _first(observation), _first_info(info)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Take one action: a number, or speed and turn rate.

        Raises:
            EnvError: the action is none.
            ResetNeeded: before the first reset, or after the episode's end.
        """
        result = self._batch.step(np.expand_dims(as_array(action), 0))
        observation, reward, terminated, truncated, info = result
        return _first(observation), float(reward[0]), bool(terminated[0]), bool(truncated[0]), _first_info(info)

    def render(self) -> np.ndarray | None:
        """What the agent sees, beside the target: (height, 2 width, 3) uint8."""
        frames = self._batch.render()
        return None if frames is None else frames[0]

    def close(self) -> None:
        """End the renderer process."""
        self._batch.close()


def _first(observation: Observation) -> Observation:
    return {key: value[0] for key, value in observation.items()}


def _first_info(info: Info) -> Info:
    """The values as Python's own bool, int and float."""
    return {key: value[0].item() for key, value in info.items() if not key.startswith("_")}
