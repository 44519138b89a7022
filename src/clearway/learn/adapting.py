"""The trainer of `adapt`: the generalist's walks, then rollouts of the network's own, and lessons after each."""

from __future__ import annotations

import torch

from clearway.agents.generalist import Generalist
from clearway.learn.adapt import Adapt
from clearway.learn.figures import Figures, check_finite
from clearway.learn.guided_walks import guided_walks
from clearway.learn.losses import LossSettings
from clearway.learn.mind_walks import MindWalks
from clearway.learn.rollout import as_rows
from clearway.learn.teacher import Teacher
from clearway.learn.trainer import Trainer
from clearway.reward import Reward
from clearway.world.world import World

MIND_SALT = 1_000_099


class AdaptingTrainer(Trainer):
    """Learns a policy for a world from the best ways among the steps seen.

    Args:
        world: tables of the scenes and targets, with features of the generalist's eyes.
        learner: the settings.
        reward: what is earned.
        seed: of everything drawn.
        generalist: walks first.

    Raises:
        RunError: as of `Trainer`.
    """

    learner: Adapt

    def __init__(self, world: World, learner: Adapt, reward: Reward, seed: int, generalist: Generalist) -> None:
        super().__init__(world, learner, reward, seed)
        self.generalist = generalist

    def update(self) -> Figures:
        """See more steps, the first time the generalist's, and learn from all; returns figures, see docs/metrics.md.

        Raises:
            RunError: the loss or a gradient is not finite.
        """
        lr = self.learner.lr_at(self.frames)
        if self.updates:
            self._walk()
        else:
            walked = guided_walks(self.world, self.generalist, self.learner, self.seed)
            self.observed.add(walked.state, walked.action, walked.arrived)
            self.frames += len(walked)
        figures = {**self._lessons(lr), "lr": lr}
        self.updates += 1
        self._rebalance()
        check_finite(figures, self.frames)
        return figures

    def _walk(self) -> None:
        """A rollout under the network's policy."""
        self._rotate()
        self.lookup.refresh()
        rollout = self.collector.collect()
        self.statistics.add(rollout)
        self.observed.add(as_rows(rollout.history)[:, -1], as_rows(rollout.action), as_rows(rollout.arrived))
        self.frames += self.frames_per_update

    def _lessons(self, lr: float) -> Figures:
        """Learn the best ways in the steps seen so far; figures are means over all steps of the optimiser."""
        learner, world = self.learner, self.world
        generator = torch.Generator(world.device).manual_seed(self.seed * MIND_SALT + self.updates)
        teacher = Teacher(world, self.navigation.reward, learner.discount, self.observed.next_state)
        settings = LossSettings(
            learner.entropy_weight_at(self.frames),
            learner.value_weight,
            learner.ratio_clip,
            learner.sum_loss,
            learner.barrier_weight_at(self.frames),
            lookahead_weight=1.0,
        )
        told, agreement = [], []
        if len(teacher.pairs):
            mind = MindWalks(world, self.lookup, self.observed.next_state, teacher, learner, generator)
            for _ in range(learner.lessons):
                self.lookup.refresh()
                batch, agreed = mind.lesson()
                told += self.learn(batch, None, lr, settings, generator)
                agreement.append(agreed)
        if not told:
            return {"agreement": 0.0, "known_ways": 0.0}
        means = torch.stack([torch.stack([s.loss.total, s.loss.value, s.loss.entropy, s.norm]) for s in told]).mean(0)
        named = dict(zip(("loss", "value_loss", "entropy", "gradient_norm"), means.tolist(), strict=True))
        return {
            **named,
            "agreement": float(torch.stack(agreement).mean()),
            "known_ways": len(teacher.pairs) / len(world.start_state),
        }
