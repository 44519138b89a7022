"""Settings of what `trainer` learns with: those that PPO and A2C share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import torch

from clearway.choices import EpisodeTargets, Goals, MatmulPrecision
from clearway.errors import RunError
from clearway.learn.learner import Learner, OnFeatures, geometric, linear, rising

if TYPE_CHECKING:
    from torch import Tensor

    from clearway.learn.share import Share
    from clearway.learn.trainer import Trainer
    from clearway.reward import Reward
    from clearway.world.world import World


@dataclass(frozen=True)
class OnPolicy(OnFeatures, Learner):
    """A synchronous actor-critic: all environments walk a rollout, then the network learns from it."""

    sees_takes: ClassVar[bool] = True

    # How much experience, and how it is gathered
    envs: int = 400
    """Environments side by side, another number being another experiment whatever the seed."""
    envs_by: Literal["states", "scenes"] = "states"
    """How environments are divided: in proportion to the scenes' states, or as many for each scene."""
    rollout_steps: int = 20
    """Steps of every environment between updates."""
    step_limit: int = 40
    """Steps after which a training episode is cut."""
    episode_targets: EpisodeTargets = "drawn"
    """Whether a target is drawn for every episode, or an environment keeps the one that it began with, as in A3C."""
    scenes_at_once: int = 0
    """Scenes that are walked at the same time, in turn with the others, see `rotation`; 0: all. With few, training on
    hundreds of scenes is as fast as on few, and needs no environment for every scene."""
    scene_updates: int = 2
    """Updates after which other scenes have their turn."""
    bootstrap_cut: bool = True
    """Add the value of the pose where an episode was cut; False treats the cut as an end, as Zhu's code does."""

    # What is learnt from
    clip_rewards: bool = False
    """Clip rewards to [-1, 1] (before scaling), as Zhu's training loop does."""
    reward_scale: float = 0.1
    """Rewards are multiplied by this, so that the target is worth 1 without clipping."""
    discount: float = 0.97
    gae_lambda: float = 0.95
    """Lambda of generalised advantage estimation; 1 gives n-step returns."""
    hindsight: bool = True
    """Learn also from passing other targets of the scene by, with truncated importance ratios."""
    goals: Goals = "given"
    """What is walked to in training: the given targets, or also poses that the learner has seen, see `own_goals`."""
    lookahead: float = 0.04
    """Weight of the cross-entropy that draws the policy towards what looking one step ahead finds better, at the start;
    falls linearly to 0, see `settle`. 0: none."""
    lookahead_temperature: float = 0.005
    """How much better counts: probabilities grow by exp(advantage / temperature) at most."""
    balance: float = 0.0
    """A target's weight at reset is 1 + balance * (1 - its recent success); 0 draws all alike."""

    # The loss
    siamese_lr: float = 2.0
    """Learning rate of the first layer's weight as a multiple of the others'."""
    value_weight: float = 0.5
    """Factor of the mean squared value error, halved: weight * 0.5 * (R - V)^2."""
    entropy_start: float = 0.02
    entropy_end: float = 0.002
    """The entropy bonus falls geometrically from start to end."""
    log_barrier: float = 1e-3
    """Weight of the mean log-probability of all actions at the start; falls linearly to 0, see `settle`. It keeps
    every action possible, where the entropy bonus lets one become certain (Agarwal et al., JMLR 2021, section 5.2)."""
    settle: float = 0.15
    """The last share of the frames, in which look-ahead and barrier are 0, so that idle actions die out."""
    sum_loss: bool = False
    """Sum the loss over a batch, as A3C does, rather than average it."""

    # The step
    optimiser: Literal["adam", "rmsprop"] = "adam"
    """rmsprop is the paper's: epsilon inside the root, mean square starting at 1."""
    lr_start: float = 5e-4
    lr_end: float = 5e-5
    """The learning rate falls linearly from start to end."""
    lr_warm_up: int = 0
    """Frames over which a factor on it rises linearly from 0 to 1; 0: none."""
    clip_norm: float = 0.5
    """Largest norm of the gradient."""
    clip_each_tensor: bool = False
    """Clip every parameter tensor by itself, as Zhu's code does, rather than all together."""
    sent_gradients: Literal["float32", "bfloat16"] = "float32"
    """What several workers send gradients to each other as; bfloat16: half the bytes, sums rounded to 8 bits."""

    # The network
    matmul_precision: MatmulPrecision = "medium"
    """highest: all arithmetic is float32; medium: factors of matrix products are rounded to bfloat16, and activations
    kept in it, on devices with instructions for it (elsewhere float32). Sums, outputs, parameters and what the
    optimiser keeps are float32."""
    heads: Literal["scene", "shared"] = "scene"
    """Whether every scene has a last hidden layer and outputs of its own, as published, or all share one. Of 1,000
    scenes they would be 265 million parameters, stepped with every minibatch."""

    def __post_init__(self) -> None:
        """Refuse settings that cannot work, or not together.

        Raises:
            RunError: as `Learner`; or targets are kept that other settings would have drawn.
        """
        super().__post_init__()
        drawn = {"balance": 0.0, "goals": "given", "scenes_at_once": 0}  # what leaves targets alone
        changed = [name for name, value in drawn.items() if getattr(self, name) != value]
        if self.episode_targets == "kept" and changed:
            other = f"{changed[0]} is {getattr(self, changed[0])}"
            raise RunError(f"episode_targets is kept and {other}, which needs targets drawn. Leave one of the two out")

    @property
    def epochs(self) -> int:
        """Passes over each rollout."""
        return 1

    @property
    def minibatches(self) -> int:
        """Parts that each pass is divided into."""
        return 1

    @property
    def siamese_step(self) -> Literal["minibatch", "pass"]:
        """When the first layer's weight moves: with every minibatch, or once a pass."""
        return "pass"

    @property
    def ratio_clip(self) -> float:
        """Clip of the probability ratio; infinite where nothing is clipped."""
        return math.inf

    @property
    def heads_by_scene(self) -> bool:
        """Whether every scene has a head of its own."""
        return self.heads == "scene"

    def lr_at(self, frames: int) -> float:
        """Learning rate after that many frames."""
        return linear(self.lr_start, self.lr_end, frames, self.frames) * rising(frames, self.lr_warm_up)

    def entropy_weight_at(self, frames: int) -> float:
        """Weight of the entropy bonus after that many frames."""
        return geometric(self.entropy_start, self.entropy_end, frames, self.frames)

    def barrier_weight_at(self, frames: int) -> float:
        """Weight of the log barrier after that many frames."""
        return self.log_barrier * self._left_at(frames)

    def lookahead_weight_at(self, frames: int) -> float:
        """Weight of look-ahead after that many frames."""
        return self.lookahead * self._left_at(frames)

    def _left_at(self, frames: int) -> float:
        """What is left of the aids that fall to 0, from 1 to 0."""
        return 1 - min(frames / ((1 - self.settle) * self.frames), 1.0)

    def trainer(self, world: World, reward: Reward, seed: int) -> Trainer:
        """A trainer at its first frame."""
        from clearway.learn.trainer import Trainer

        return Trainer(world, self, reward, seed)

    def check_workers(self, states: Tensor) -> None:
        """Raise RunError where a setting is for one worker alone, or environments do not suffice."""
        from clearway.learn.rotation import divided_envs

        if self.scenes_at_once:
            raise RunError("scenes_at_once: several workers walk all scenes at a time. Leave it out, or --workers")
        if self.goals == "seen":
            raise RunError("goals=seen: own goals are for one worker. Leave it out, or --workers")
        divided_envs(states, self, torch.arange(len(states)))

    def part_trainer(self, world: World, reward: Reward, seed: int, share: Share) -> Trainer:
        """The trainer of one of several workers."""
        from clearway.learn.trainer import Trainer

        return Trainer(world, self, reward, seed, share)
