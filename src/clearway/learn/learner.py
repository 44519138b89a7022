"""What the settings of all algorithms have in common: `Learner`, an algorithm with its settings.

An algorithm is a file: a frozen dataclass of its settings, derived from `Learner`, and what it learns with. Settings of
the same name mean the same in all of them. The names are in `algorithms`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, ClassVar

from clearway.errors import RunError
from clearway.learn.kinds import called, field_types, fits, is_finite

if TYPE_CHECKING:
    from torch import Tensor

    from clearway.learn.load import TrainedAgent
    from clearway.learn.run_record import RunRecord
    from clearway.learn.running import Learning
    from clearway.learn.share import Share
    from clearway.reward import Reward
    from clearway.scenes.scene import Scene
    from clearway.world.world import World

AT_LEAST_ONE = {"frames", "envs", "rollout_steps", "step_limit", "epochs", "minibatches", "width"}
AT_LEAST_ONE |= {"scene_updates", "history_length"}
MORE_THAN_ZERO = {
    "entropy_start",
    "entropy_end",
    "lr_start",
    "siamese_lr",
    "clip_norm",
    "reward_scale",
    "lookahead_temperature",
}
AT_LEAST_ZERO = {
    "scenes_at_once",
    "lr_end",
    "balance",
    "log_barrier",
    "lookahead",
    "lr_warm_up",
    "ratio_clip",
    "value_weight",
    "feature_basis",
}
ZERO_TO_ONE = {"discount", "gae_lambda", "step_size", "explore_start", "explore_end"}
BELOW_ONE = {"settle"}


@dataclass(frozen=True)
class Learner:
    """An algorithm with its settings: everything that shapes learning apart from scenes, targets, reward and seed.

    Attributes:
        algorithm: its name.
        acts_on: the part of the trainer's tensors that an agent needs to act.
        sees_takes: whether it learns from perturbed pictures of poses too.
    """

    algorithm: ClassVar[str]
    acts_on: ClassVar[str] = "network"
    sees_takes: ClassVar[bool] = False

    frames: int = 3_000_000
    """Training frames over all environments; schedules end here."""

    def __post_init__(self) -> None:
        """Refuse settings that cannot work.

        Raises:
            RunError: a value is of another type than its field, or out of range.
        """
        for name, wanted in field_types(type(self)).items():
            value = getattr(self, name)
            if type(value).__module__ == "numpy" and hasattr(value, "item"):  # a number as records hold it
                value = value.item()
                object.__setattr__(self, name, value)
            _check_range(name, value)
            if not fits(value, wanted):
                raise RunError(f"{name} is {value!r:.40}, expected {called(wanted)}. Correct it")

    @property
    def clip_rewards(self) -> bool | None:
        """Whether training clips rewards to [-1, 1]; None where there is no such setting: as the reward itself says."""
        return None

    @property
    def reward_scale(self) -> float:
        """What rewards are multiplied by."""
        return 1.0

    @property
    def history_length(self) -> int:
        """Poses that the agent knows, the present one among them."""
        return 1

    @property
    def heads_by_scene(self) -> bool:
        """Whether the agent has a part of its own for every scene, so that it acts in its own scenes alone."""
        return True

    def head_count(self, scenes: int) -> int:
        """Heads of a network for so many scenes."""
        return scenes if self.heads_by_scene else 1

    def check_sees_takes(self) -> None:
        """Raise RunError where it learns from the scenes' own pictures alone."""
        if not self.sees_takes:
            problem = f"perturb: {self.algorithm} learns from the scenes' own pictures alone"
            raise RunError(f"{problem}. Leave it out, or train by ppo, a2c or recurrent")

    def warn_of(self, scenes: Sequence[Scene]) -> None:
        """Warn of scenes by whose pictures it would be led astray; by default of none."""

    def paid(self, reward: Reward) -> Reward:
        """The reward as training pays it: `clip_rewards` alone says whether it is clipped, where there is that setting.

        Raises:
            RunError: the reward clips and the setting does not, so that one of the two is a mistake.
        """
        if self.clip_rewards is None:
            return reward
        if reward.clip and not self.clip_rewards:
            problem = f"reward {reward.name} clips, and {self.algorithm}'s setting clip_rewards does not"
            raise RunError(
                f"{problem}. Set clip_rewards to true (--set clip_rewards=true), or take clip=True out of the reward"
            )
        return replace(reward, clip=self.clip_rewards)

    def trainer(self, world: World, reward: Reward, seed: int) -> Learning:
        """A trainer at its first frame; the reward is that of `paid`.

        Raises:
            RunError: the seed or the settings do not fit the world.
        """
        raise NotImplementedError

    def check_workers(self, states: Tensor) -> None:
        """Raise RunError where several workers cannot train it on scenes of so many states (C,) int64."""
        raise RunError(f"{self.algorithm} is trained by one worker. Leave --workers out, or use ppo, a2c or bc")

    def part_trainer(self, world: World, reward: Reward, seed: int, share: Share) -> Learning:
        """The trainer of one of several workers, whose scenes are those of `world`; otherwise as `trainer`."""
        raise NotImplementedError

    def agent(self, record: RunRecord, tensors: Mapping[str, Tensor], frames: int) -> TrainedAgent:
        """The agent of a run from the tensors of its checkpoint, after that many frames.

        Raises:
            LookupError, RuntimeError, ValueError: the tensors do not fit the run.
        """
        from clearway.learn.load import network_agent

        return network_agent(record, tensors, frames)


@dataclass(frozen=True)
class OnFeatures:
    """Settings of what learns a network on the scenes' features."""

    centre_features: bool = True
    """Centre features and give them a root mean square of 1, by one global factor."""
    whiten_features: bool = True
    """Scale directions down in which features vary more than on average; see `FeatureMap.fitted`."""
    feature_basis: int = 0
    """Express features in so many leading principal directions; 0 keeps them. S poses span at most S directions, so a
    basis of that size loses nothing and costs less where poses are few."""
    width: int = 512
    history_length: int = 4


def next_steps(frames: int, all_frames: int, envs: int, rollout_steps: int, least: int = 1) -> int:
    """Steps of the next rollout, after some frames: fewer in the last, so that it ends with the frames asked for.

    A step is one of all environments, so that up to `envs - 1` more are used where they do not divide the frames.

    Args:
        frames: used so far.
        all_frames: asked for.
        envs: environments.
        rollout_steps: of a whole rollout.
        least: steps that can be learnt from.
    """
    return min(rollout_steps, max(least, -(-(all_frames - frames) // envs)))


def linear(start: float, end: float, frames: int, all_frames: int) -> float:
    """A setting that goes linearly from start to end over all frames, after some of them."""
    return start + (end - start) * min(frames / all_frames, 1.0)


def rising(frames: int, warm_up: int) -> float:
    """A factor that rises linearly from 0 to 1 over the first `warm_up` frames, after some of them."""
    return min(frames / warm_up, 1.0) if warm_up else 1.0


def geometric(start: float, end: float, frames: int, all_frames: int) -> float:
    """A setting that goes geometrically from start to end over all frames, after some of them."""
    return start * (end / start) ** min(frames / all_frames, 1.0)


def setting_names(kind: type[Learner]) -> tuple[str, ...]:
    """Names of an algorithm's settings."""
    return tuple(field.name for field in fields(kind))


def _check_range(name: str, value: object) -> None:
    if not isinstance(value, int | float):
        return
    if not is_finite(value):
        raise RunError(f"{name} is {value!r:.40}, expected a finite figure. Give a large one instead")
    if name in AT_LEAST_ONE and value < 1:
        raise RunError(f"{name} is {value}, expected at least 1. Give a larger {name}")
    if name in ZERO_TO_ONE and not 0 <= value <= 1:
        raise RunError(f"{name} is {value}, expected 0 to 1. Give a value in that range")
    if name in MORE_THAN_ZERO and not value > 0:
        raise RunError(f"{name} is {value}, expected more than 0. Give a positive {name}")
    if name in AT_LEAST_ZERO and not value >= 0:
        raise RunError(f"{name} is {value}, expected at least 0. Give a larger {name}")
    if name in BELOW_ONE and not 0 <= value < 1:
        raise RunError(f"{name} is {value}, expected 0 to 1, 1 excluded. Give a value in that range")
