"""The learner's settings and the named sets of them."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Literal

from clearway.choices import MatmulPrecision
from clearway.errors import RunError

if TYPE_CHECKING:
    from clearway.reward import Reward

Algorithm = Literal["ppo", "a2c", "a3c"]
PresetName = Literal["default", "paper", "paper-a3c"]


_A3C_NEEDS: dict[str, object] = {
    "heads": "scene",
    "scenes_at_once": 0,
    "envs_by": "scenes",
    "reward_scale": 1,
    "epochs": 1,
    "minibatches": 1,
    "siamese_lr": 1,
    "siamese_step": "pass",
    "ratio_clip": 0.2,
    "scene_updates": 2,
    "hindsight": False,
    "balance": 0,
    "log_barrier": 0,
    "lookahead": 0,
    "optimiser": "rmsprop",
    "matmul_precision": "highest",
}

ADDED_LATER: dict[str, object] = {
    "heads": "scene",
    "scenes_at_once": 0,
    "scene_updates": 2,
    "settle": 0.0,
    "matmul_precision": "highest",
}
"""Settings that runs may have been made without, and what holds for those."""


@dataclass(frozen=True)
class Learner:
    """Everything that shapes learning apart from scenes, targets, reward and seed."""

    # How much experience, and how it is gathered
    frames: int = 3_000_000
    """Training frames over all environments; schedules end here."""
    envs: int = 400
    """Environments side by side, another number being another experiment whatever the seed. Of a3c: workers, worker i
    for target i modulo the number of targets."""
    envs_by: Literal["states", "scenes"] = "states"
    """How environments are divided: in proportion to the scenes' states, or as many for each scene."""
    rollout_steps: int = 20
    """Steps of every environment between updates. Of a3c: the most steps of a segment."""
    step_limit: int = 40
    """Steps after which a training episode is cut."""
    scenes_at_once: int = 0
    """Scenes that are walked at the same time, in turn with the others, see `rotation`; 0: all. With few, training on
    hundreds of scenes is as fast as on few, and needs no environment for every scene."""
    scene_updates: int = 2
    """Updates after which other scenes have their turn."""
    bootstrap_cut: bool = True
    """Add the value of the pose where an episode was cut; False treats the cut as an end, as Zhu's code does."""

    # What is learnt from
    reward_scale: float = 0.1
    """Rewards are multiplied by this, so that the target is worth 1 without clipping."""
    clip_rewards: bool = False
    """Clip rewards to [-1, 1] (before scaling), as Zhu's training loop does."""
    centre_features: bool = True
    """Centre features and give them a root mean square of 1, by one global factor."""
    whiten_features: bool = True
    """Scale directions down in which features vary more than on average; see `FeatureMap.fitted`."""
    feature_basis: int = 0
    """Express features in so many leading principal directions; 0 keeps them. S poses span at most S directions, so a
    basis of that size loses nothing and costs less where poses are few."""
    discount: float = 0.97
    gae_lambda: float = 0.95
    """Lambda of generalised advantage estimation; 1 gives n-step returns."""
    hindsight: bool = True
    """Learn also from passing other targets of the scene by, with truncated importance ratios."""
    lookahead: float = 0.04
    """Weight of the cross-entropy that draws the policy towards what looking one step ahead finds better, at the start;
    falls linearly to 0, see `settle`. 0: none."""
    lookahead_temperature: float = 0.005
    """How much better counts: probabilities grow by exp(advantage / temperature) at most."""
    balance: float = 0.0
    """A target's weight at reset is 1 + balance * (1 - its recent success); 0 draws all alike."""

    # The loss
    algorithm: Algorithm = "ppo"
    epochs: int = 2
    """Passes over each rollout (1 with one minibatch is plain A2C)."""
    minibatches: int = 4
    """Parts that each pass is divided into."""
    siamese_step: Literal["minibatch", "pass"] = "pass"
    """When the first layer's weight moves, which costs most: with every minibatch, or once a pass with the mean of its
    minibatches' gradients."""
    siamese_lr: float = 2.0
    """Learning rate of the first layer's weight as a multiple of the others'."""
    ratio_clip: float = 0.2
    """PPO's clip of the probability ratio."""
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
    clip_norm: float = 0.5
    """Largest norm of the gradient."""
    clip_each_tensor: bool = False
    """Clip every parameter tensor by itself, as Zhu's code does, rather than all together."""

    # The network
    matmul_precision: MatmulPrecision = "medium"
    """highest: all arithmetic is float32; medium: factors of matrix products are rounded to bfloat16, and activations
    kept in it, on devices with instructions for it (elsewhere float32). Sums, outputs, parameters and what the
    optimiser keeps are float32."""
    width: int = 512
    history_length: int = 4
    heads: Literal["scene", "shared"] = "scene"
    """Whether every scene has a last hidden layer and outputs of its own, as published, or all share one. Of 1,000
    scenes they would be 265 million parameters, stepped with every minibatch."""

    def __post_init__(self) -> None:
        """Refuse settings that cannot work.

        Raises:
            RunError: a value is out of range.
        """
        for name, value in asdict(self).items():
            if isinstance(value, float) and not math.isfinite(value):
                raise RunError(f"{name} is {value}, expected a finite figure. Give a large one instead")
        at_least_one = ("frames", "envs", "rollout_steps", "step_limit", "epochs", "minibatches", "width")
        for name in (*at_least_one, "scene_updates", "history_length"):
            if getattr(self, name) < 1:
                raise RunError(f"{name} is {getattr(self, name)}, expected at least 1. Give a larger {name}")
        for name in ("discount", "gae_lambda"):
            if not 0 <= getattr(self, name) <= 1:
                raise RunError(f"{name} is {getattr(self, name)}, expected 0 to 1. Give a value in that range")
        for name in (
            "entropy_start",
            "entropy_end",
            "lr_start",
            "siamese_lr",
            "clip_norm",
            "reward_scale",
            "lookahead_temperature",
        ):
            if not getattr(self, name) > 0:
                raise RunError(f"{name} is {getattr(self, name)}, expected more than 0. Give a positive {name}")
        not_negative = ("scenes_at_once", "lr_end", "balance", "log_barrier", "lookahead", "ratio_clip", "value_weight")
        for name in (*not_negative, "feature_basis"):
            if not getattr(self, name) >= 0:
                raise RunError(f"{name} is {getattr(self, name)}, expected at least 0. Give a larger {name}")
        if not 0 <= self.settle < 1:
            raise RunError(f"settle is {self.settle}, expected 0 to 1, 1 excluded. Give a value in that range")
        if self.algorithm == "a2c" and (self.epochs, self.minibatches) != (1, 1):
            raise RunError("a2c makes one pass over each rollout. Set epochs and minibatches to 1, or use ppo")
        if self.algorithm == "a3c":
            for name, needed in _A3C_NEEDS.items():
                if getattr(self, name) != needed:
                    raise RunError(
                        f"a3c with {name} {getattr(self, name)}, expected {needed}. Set {name} to {needed}, "
                        "or take the preset paper-a3c"
                    )

    def told_apart_by(self) -> dict[str, object]:
        """The settings by name, without those in `ADDED_LATER` that are as they always were."""
        return {name: value for name, value in asdict(self).items() if ADDED_LATER.get(name) != value}

    def paid(self, reward: Reward) -> Reward:
        """The reward as training pays it: clipped, where it or these settings say so."""
        return replace(reward, clip=reward.clip or self.clip_rewards)

    def head_count(self, scenes: int) -> int:
        """Heads of a network for so many scenes."""
        return scenes if self.heads == "scene" else 1

    def lr_at(self, frames: int) -> float:
        """Learning rate after that many frames."""
        return self.lr_start + (self.lr_end - self.lr_start) * min(frames / self.frames, 1.0)

    def entropy_weight_at(self, frames: int) -> float:
        """Weight of the entropy bonus after that many frames."""
        return self.entropy_start * (self.entropy_end / self.entropy_start) ** min(frames / self.frames, 1.0)

    def barrier_weight_at(self, frames: int) -> float:
        """Weight of the log barrier after that many frames."""
        return self.log_barrier * self._left_at(frames)

    def lookahead_weight_at(self, frames: int) -> float:
        """Weight of look-ahead after that many frames."""
        return self.lookahead * self._left_at(frames)

    def _left_at(self, frames: int) -> float:
        """What is left of the aids that fall to 0, from 1 to 0."""
        return 1 - min(frames / ((1 - self.settle) * self.frames), 1.0)

    def as_a2c(self) -> Learner:
        """The same settings with one update a rollout."""
        return replace(self, algorithm="a2c", epochs=1, minibatches=1)


DEFAULT = Learner()
"""PPO with hindsight and look-ahead; why each part is there, with figures: docs/learning.md."""

PAPER_A2C = Learner(
    frames=10_000_000,
    envs=100,
    envs_by="scenes",
    rollout_steps=5,
    step_limit=5000,
    bootstrap_cut=False,
    reward_scale=1.0,
    clip_rewards=True,
    centre_features=False,
    whiten_features=False,
    discount=0.99,
    gae_lambda=1.0,
    hindsight=False,
    lookahead=0.0,
    balance=0.0,
    algorithm="a2c",
    epochs=1,
    minibatches=1,
    siamese_lr=1.0,
    value_weight=0.5,
    entropy_start=0.01,
    entropy_end=0.01,
    log_barrier=0.0,
    settle=0.0,
    sum_loss=True,
    optimiser="rmsprop",
    lr_start=7.0e-4,
    lr_end=0.0,
    clip_norm=40.0,
    clip_each_tensor=True,
    matmul_precision="highest",
)
"""The published settings, synchronous: 5-step returns, discount 0.99, entropy 0.01, RMSProp, rewards clipped."""

PAPER_A3C = replace(PAPER_A2C, algorithm="a3c", envs=20)
"""The published algorithm: 20 asynchronous workers, a target each; more targets need more workers (`envs`)."""

PRESETS: dict[PresetName, Learner] = {"default": DEFAULT, "paper": PAPER_A2C, "paper-a3c": PAPER_A3C}
