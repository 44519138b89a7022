"""`ImageGoalEnv`: Gymnasium's single environment, a batch of one of `ImageGoalVectorEnv`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from clearway.choices import ZoneLevel
from clearway.envs.arguments import RESET_MASK, SceneSource, seed_words
from clearway.envs.render import RENDER_MODES
from clearway.envs.spaces import ObservationKind
from clearway.envs.vector import ImageGoalVectorEnv, Info, Observation
from clearway.errors import EnvError
from clearway.reward import Reward
from clearway.scenes.sensors import RGB
from clearway.world.navigation import HISTORY_LENGTH


class ImageGoalEnv(gymnasium.Env[Observation, int]):
    """An agent in a furnished room walks to the place where a picture was taken.

    ## Description

    The room is a grid of cells with four headings each: its poses, or states. The agent sees the pictures (or their
    features) of its last poses and the target's picture, and nothing else. After Zhu et al., "Target-driven visual
    navigation in indoor scenes", ICRA 2017, with the reward of "Collision anticipation via deep reinforcement learning
    for visual navigation", which makes poses near obstacles cost more.

    ## Action Space

    `Discrete(4)`, or with `stop=True` `Discrete(5)`

    | Num | Action        |
    |-----|---------------|
    | 0   | move forward  |
    | 1   | turn right    |
    | 2   | turn left     |
    | 3   | move backward |
    | 4   | stop          |

    A move into an obstacle is blocked: the agent stays, the step counts, and so does one collision.

    ## Observation Space

    `Dict` of two boxes, float32 features or uint8 pictures by the argument `observations`:

    | Key           | Features | Pictures       | Meaning                                                     |
    |---------------|----------|----------------|-------------------------------------------------------------|
    | `observation` | `(K, F)` | `(K, H, W, 3)` | the last K poses, newest last; a blocked move repeats one   |
    | `target`      | `(F,)`   | `(H, W, 3)`    | the picture to find the place of                            |

    Features are bounded by the power of two above the largest of the scenes. Further sensors that `sensors` names,
    where the scenes have them, add two boxes each, of the sensor's dtype, unit and range: with
    `observations="pictures", sensors=("rgb", "depth")` `depth` `(K, H, W)` and `target_depth` `(H, W)`, float32 metres.

    ## Rewards

    By the pose the agent arrives in: 10 at the target, -0.02 in the collision zone (moving forward or backward is
    blocked there), -0.011 in the precollision zone (one such move leads into the collision zone), -0.01 elsewhere. A
    blocked move arrives in the pose it left. With `reward="shortest"` every step costs 0.01, with `"bump"` a blocked
    move 0.1, with `"clearance"` the more the closer to an obstacle a step ends; a `clearway.reward.Reward` is made of
    terms with parameters of their own, and can clip to [-1, 1].

    `info["cost"]` is 1.0 on a blocked move and 0.0 otherwise, for algorithms with constraints.

    ## Starting State

    The target is drawn uniformly from the targets, the start uniformly from the states that it can be reached from,
    itself excluded. All K poses of the first history are the start.
    `reset(options={"scene": name, "target": id, "start": state})` fixes any of the three; ids are the scene's own.

    ## Episode End

    1. Termination: the agent is in the target's pose, position and heading. As in the paper there is no action to stop.
       With `stop=True` instead: the agent stops, which earns the target's reward in the target's pose
       (`info["distance_to_go"]` is 0) and elsewhere what a step earns that ends where it began.
    2. Truncation: after `max_episode_steps` steps (500 through `gymnasium.make`). Where the last of them reaches the
       target, `gymnasium.make`'s time limit says both, the vector environment termination alone.

    ## Information

    `collision` (bool, the move was blocked), `cost`, `zone` (0 free, 1 precollision, 2 collision), `distance_to_go`
    (shortest-path steps to the target), `scene` (index in `scene_names`), `state` and `target` (the scene's own ids).

    ## Arguments

    | Parameter           | Default             | Description                                                        |
    |---------------------|---------------------|--------------------------------------------------------------------|
    | `scenes`            | required            | a `Scene` or scene file, or several of one encoder                 |
    | `targets`           | `None`              | state ids by scene name; None: `scenes.targets.default_targets`;   |
    |                     |                     | "held-out": some that trainings in generated rooms leave out       |
    | `reward`            | `"collision-aware"` | or another of `reward.REWARDS`, a `Reward`, or package.module:name |
    | `observations`      | `"features"`        | or `"pictures"`                                                    |
    | `sensors`           | `("rgb",)`          | whose pictures, for example `("rgb", "depth")`                     |
    | `zone_level`        | `"pose"`            | or `"cell"`: a cell is in a zone where any of its headings is      |
    | `max_episode_steps` | `None`              | steps until truncation; None for no limit (`make` sets 500)        |
    | `history_length`    | `4`                 | K                                                                  |
    | `stop`              | `False`             | a fifth action ends the episode, nothing else does                 |
    | `render_mode`       | `None`              | `"rgb_array"` (view, target and map side by side) or `"ansi"`      |

    ```python
    >>> import gymnasium  # which knows it once clearway is installed
    >>> env = gymnasium.make("Clearway/ImageGoal-v0", scenes="bathroom.h5")
    >>> envs = gymnasium.make_vec("Clearway/ImageGoal-v0", num_envs=64, scenes="bathroom.h5")

    ```

    ## Version History

    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 4}  # noqa: RUF012

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
        render_mode: str | None = None,
    ) -> None:
        self._batch = ImageGoalVectorEnv(
            scenes,
            targets=targets,
            reward=reward,
            observations=observations,
            sensors=sensors,
            zone_level=zone_level,
            max_episode_steps=max_episode_steps,
            history_length=history_length,
            stop=stop,
            autoreset_mode=AutoresetMode.DISABLED,
            render_mode=render_mode,
        )
        self.render_mode = render_mode
        self.observation_space = self._batch.single_observation_space
        self.action_space = self._batch.single_action_space

    @property
    def scene_names(self) -> tuple[str, ...]:
        """Name of each scene, in the order of `info["scene"]`."""
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

    def step(self, action: int) -> tuple[Observation, float, bool, bool, Info]:
        """Take one action, 0 to 3, or 4 to stop where there is that action.

        Raises:
            EnvError: the action is not one of them.
            ResetNeeded: before the first reset, or after the episode's end.
        """
        result = self._batch.step(np.expand_dims(np.asarray(action), 0))
        observation, reward, terminated, truncated, info = result
        return _first(observation), float(reward[0]), bool(terminated[0]), bool(truncated[0]), _first_info(info)

    def render(self) -> Any:
        """The agent's view, the target and the map, (height, width, 3) uint8; the map as text in the mode "ansi"."""
        frames = self._batch.render()
        return None if frames is None else frames[0]


def _first(observation: Observation) -> Observation:
    return {key: value[0] for key, value in observation.items()}


def _first_info(info: Info) -> Info:
    """The values as Python's own bool, int and float."""
    return {key: value[0].item() for key, value in info.items() if not key.startswith("_")}
