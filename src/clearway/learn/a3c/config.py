"""Settings of A3C."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from clearway.choices import EpisodeTargets
from clearway.learn.learner import Learner, OnFeatures, geometric, linear, rising

if TYPE_CHECKING:
    from clearway.learn.a3c.parent import AsyncTrainer
    from clearway.reward import Reward
    from clearway.world.world import World


@dataclass(frozen=True)
class A3C(OnFeatures, Learner):
    """Asynchronous workers on shared parameters, by default as published (Zhu et al., ICRA 2017)."""

    algorithm: ClassVar[str] = "a3c"

    frames: int = 10_000_000
    """Training frames over all workers; schedules end here."""
    envs: int = 20
    """Workers, of which worker i begins with target i modulo the number of targets; more targets need more of them."""
    rollout_steps: int = 5
    """The most steps of a segment, after which a worker learns."""
    step_limit: int = 5000
    """Steps after which a training episode is cut."""
    episode_targets: EpisodeTargets = "kept"
    """Whether a worker keeps its target, as Zhu's threads do, or draws one of its scene for every episode."""
    bootstrap_cut: bool = False
    """Add the value of the pose where an episode was cut; False treats the cut as an end, as Zhu's code does."""
    clip_rewards: bool = True
    """Clip rewards to [-1, 1], as Zhu's training loop does."""
    centre_features: bool = False
    """Centre features and give them a root mean square of 1, by one global factor."""
    whiten_features: bool = False
    """Scale directions down in which features vary more than on average; see `FeatureMap.fitted`."""
    discount: float = 0.99
    gae_lambda: float = 1.0
    """Lambda of generalised advantage estimation; 1 gives n-step returns."""
    value_weight: float = 0.5
    """Factor of the mean squared value error, halved: weight * 0.5 * (R - V)^2."""
    entropy_start: float = 0.01
    entropy_end: float = 0.01
    """The entropy bonus falls geometrically from start to end."""
    sum_loss: bool = True
    """Sum the loss over a segment rather than average it."""
    lr_start: float = 7.0e-4
    lr_end: float = 0.0
    """The learning rate falls linearly from start to end."""
    lr_warm_up: int = 0
    """Frames over which a factor on it rises linearly from 0 to 1; 0: none."""
    clip_norm: float = 40.0
    """Largest norm of a worker's gradient."""
    clip_each_tensor: bool = True
    """Clip every parameter tensor by itself, as Zhu's code does, rather than all together."""

    def lr_at(self, frames: int) -> float:
        """Learning rate after that many frames."""
        return linear(self.lr_start, self.lr_end, frames, self.frames) * rising(frames, self.lr_warm_up)

    def entropy_weight_at(self, frames: int) -> float:
        """Weight of the entropy bonus after that many frames."""
        return geometric(self.entropy_start, self.entropy_end, frames, self.frames)

    def trainer(self, world: World, reward: Reward, seed: int) -> AsyncTrainer:
        """A trainer at its first frame, of as many processes as torch has threads."""
        import torch

        from clearway.learn.a3c.parent import AsyncTrainer

        return AsyncTrainer(world, self, reward, seed, torch.get_num_threads())
