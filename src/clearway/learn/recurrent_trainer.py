"""The trainer of the recurrent agent: the planner teaches it, then PPO; one call an update. See `recurrent`.

Axis letters: T steps, N environments, D numbers of a pair, H width, A actions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from clearway.learn.figures import Figures, check_finite
from clearway.learn.learner import geometric, linear
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.optimiser import Adam, clip_gradients
from clearway.learn.returns import generalised_advantages
from clearway.learn.rollout import ACTION_STREAM, sample_actions
from clearway.learn.statistics import EpisodeStatistics
from clearway.learn.teacher import Teacher
from clearway.model.recurrent import LAST_COUNT, RecurrentActorCritic, RecurrentShape, SeenPairs, last_step
from clearway.perception.eyes_network import Eyes
from clearway.reward import Reward
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.streams import Streams
from clearway.world.world import World

if TYPE_CHECKING:
    from clearway.learn.recurrent import Recurrent

TEACHER_STREAM, WHO_STREAM, FIT_STREAM, SHUFFLE_STREAM = 11, 12, 13, 14
FIT_PAIRS = 4096  # by which what is seen is standardised
VALUE_WEIGHT = 1.0


@dataclass(frozen=True)
class Walked:
    """T steps of N environments.

    Attributes:
        pairs: (T, N, D), what was seen beside the target.
        last: (T, N, LAST_COUNT), of the step before.
        hidden: (N, H), what was remembered before the first step.
        begins: (T, N) bool, an episode begins with this step.
        action, target: (T, N) int64.
        log_probability, value: (T, N), by the policy that walked.
        reward: (T, N) float32.
        reached, truncated, blocked: (T, N) bool.
        value_after: (N,), of what is seen after the last step.
    """

    pairs: Tensor
    last: Tensor
    hidden: Tensor
    begins: Tensor
    action: Tensor
    target: Tensor
    log_probability: Tensor
    value: Tensor
    reward: Tensor
    reached: Tensor
    truncated: Tensor
    blocked: Tensor
    value_after: Tensor


class RecurrentTrainer:
    """Learns one policy for all scenes of a world.

    Args:
        world: tables of the scenes and targets; must hold features that the eyes made.
        learner: the settings.
        reward: what is earned, and what the teacher's actions are best under.
        seed: of parameters, environments and actions.
        eyes: made the features.

    Raises:
        RunError: there are no best walks under the reward and the discount.
    """

    def __init__(self, world: World, learner: Recurrent, reward: Reward, seed: int, eyes: Eyes) -> None:
        assert world.features is not None, "scenes that name their encoder have features"
        self.world, self.learner, self.seed = world, learner, seed
        self.frames, self.updates = 0, 0
        device, count = world.device, learner.envs
        self.pairs = SeenPairs(eyes).to(device)
        self.network = RecurrentActorCritic(RecurrentShape(self.pairs.count, learner.width), seed).to(device)
        self.optimiser = Adam(dict(self.network.named_parameters()))
        self.teacher = Teacher(world, reward, learner.discount)
        seeds = torch.arange(count, dtype=torch.int64, device=device) + (seed << 32)
        scene = torch.arange(count, device=device) * world.scene_count // count
        choice = TargetChoice.by_scene(world, scene) if count >= world.scene_count else None
        self.navigation = Navigation(
            world, reward, seeds, choice=choice, step_limit=learner.step_limit, history_length=1
        )
        self.statistics = EpisodeStatistics(count, world.target_count, device)
        self.streams = {
            name: Streams(seeds, purpose)
            for name, purpose in (("actions", ACTION_STREAM), ("teacher", TEACHER_STREAM), ("who", WHO_STREAM))
        }
        self.hidden = torch.zeros(count, learner.width, device=device)
        self.last = torch.zeros(count, LAST_COUNT, device=device)
        self._fit()
        self.navigation.begin_staggered()

    @property
    def finished(self) -> bool:
        """All frames of the settings are used."""
        return self.frames >= self.learner.frames

    @property
    def is_taught(self) -> bool:
        """Whether the planner teaches the next update."""
        return self.frames < self.learner.taught_frames

    def update(self) -> Figures:
        """Walk and learn; figures of it, see docs/metrics.md.

        Raises:
            RunError: the loss or a gradient is not finite.
        """
        figures = self._be_taught() if self.is_taught else self._earn()
        self.frames += self.learner.envs * self.learner.rollout_steps
        self.updates += 1
        check_finite(figures, self.frames)
        return figures

    def _be_taught(self) -> Figures:
        """Walk T steps and learn the teacher's actions on the way."""
        learner, progress = self.learner, self.frames / self.learner.taught_frames
        hidden, losses, agreements, walked = self.hidden, [], [], []
        for _ in range(learner.rollout_steps):
            target, state = self.navigation.target, self.navigation.state
            best = self.teacher[target, state]
            said = self.network(self._seen(), self.last, hidden)
            log_probability = torch.log_softmax(said.scores, dim=1)
            right = torch.where(best, log_probability, -torch.inf).logsumexp(dim=1)
            losses.append(-right.mean())
            agreements.append(right.detach().exp().mean())
            own = sample_actions(said.scores.detach(), self.streams["actions"].uniform())
            teachers = sample_actions(torch.where(best, 0.0, -torch.inf), self.streams["teacher"].uniform())
            by_teacher = self.streams["who"].uniform() < learner.teacher_share * (1 - progress)
            step = self._step(torch.where(by_teacher, teachers, own))
            hidden = torch.where(step[2][:, None], 0.0, said.hidden)
            walked.append((target, *step))
        self.hidden = hidden.detach()
        self._count(walked)
        loss = torch.stack(losses).mean()
        self._differentiate(loss)
        norm = clip_gradients(self._gradients(), learner.clip_norm, each_tensor=False)
        lr = geometric(learner.taught_lr_start, learner.taught_lr_end, self.frames, learner.taught_frames)
        self.optimiser.step(lr)
        agreement = torch.stack(agreements).mean()
        return {"loss": loss.item(), "agreement": agreement.item(), "gradient_norm": norm.item(), "lr": lr}

    def _earn(self) -> Figures:
        """Walk T steps and learn from what they earned."""
        learner = self.learner
        before, left = learner.taught_frames, learner.frames - learner.taught_frames
        lr = geometric(learner.lr_start, learner.lr_end, self.frames - before, left)
        entropy_weight = linear(learner.entropy_start, learner.entropy_end, self.frames - before, left)
        walked = self._walk()
        discount = torch.where(walked.reached | walked.truncated, 0.0, learner.discount)
        advantage = generalised_advantages(
            walked.reward, discount, walked.value, walked.value_after, learner.gae_lambda
        )
        returns = advantage + walked.value
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-6)
        told = []
        for epoch in range(learner.epochs):
            order = torch.from_numpy(self._shuffled(epoch)).to(self.world.device)
            for some in order.chunk(learner.minibatches):
                told.append(self._improve(walked, some, advantage, returns, entropy_weight, lr))
        means = torch.stack(told).mean(0).tolist()
        names = ("loss", "policy_loss", "value_loss", "entropy", "gradient_norm")
        return {**dict(zip(names, means, strict=True)), "lr": lr}

    def _improve(
        self, walked: Walked, some: Tensor, advantage: Tensor, returns: Tensor, entropy_weight: float, lr: float
    ) -> Tensor:
        """One step of PPO on some environments; loss, its parts, entropy and the gradient's norm, (5,)."""
        hidden, scores, values = walked.hidden[some], [], []
        for step in range(len(walked.pairs)):
            hidden = torch.where(walked.begins[step, some][:, None], 0.0, hidden)
            said = self.network(walked.pairs[step, some], walked.last[step, some], hidden)
            hidden = said.hidden
            scores.append(said.scores)
            values.append(said.value)
        log_probabilities = torch.log_softmax(torch.stack(scores), dim=2)
        taken = log_probabilities.gather(2, walked.action[:, some, None])[..., 0]
        ratio = (taken - walked.log_probability[:, some]).exp()
        clipped = ratio.clamp(1 - self.learner.ratio_clip, 1 + self.learner.ratio_clip)
        gain = advantage[:, some]
        policy_loss = -torch.minimum(ratio * gain, clipped * gain).mean()
        value_loss = (torch.stack(values) - returns[:, some]).square().mean() / 2
        entropy = -(log_probabilities.exp() * log_probabilities).sum(dim=2).mean()
        loss = policy_loss + VALUE_WEIGHT * value_loss - entropy_weight * entropy
        self._differentiate(loss)
        norm = clip_gradients(self._gradients(), self.learner.clip_norm, each_tensor=False)
        self.optimiser.step(lr)
        return torch.stack([loss, policy_loss, value_loss, entropy, norm]).detach()

    @torch.no_grad()
    def _walk(self) -> Walked:
        """T steps by the policy."""
        rows, walked, hidden_first = [], [], self.hidden
        begins = torch.zeros(self.learner.envs, dtype=torch.bool, device=self.world.device)
        for _ in range(self.learner.rollout_steps):
            pairs, last, target = self._seen(), self.last, self.navigation.target
            said = self.network(pairs, last, self.hidden)
            action = sample_actions(said.scores, self.streams["actions"].uniform())
            log_probability = torch.log_softmax(said.scores, dim=1).gather(1, action[:, None])[:, 0]
            step = self._step(action, said.hidden)
            rows.append((pairs, last, begins, action, target, log_probability, said.value, step[0]))
            walked.append((target, *step))
            begins = step[2]
            self.hidden = torch.where(begins[:, None], 0.0, said.hidden)
        value_after = self.network(self._seen(), self.last, self.hidden).value
        self._count(walked)
        pairs, last, begin, action, target, log_probability, value, reward = (
            torch.stack(part) for part in zip(*rows, strict=True)
        )
        _, _, reached, ended, blocked = (torch.stack(part) for part in zip(*walked, strict=True))
        return Walked(
            pairs=pairs,
            last=last,
            hidden=hidden_first,
            begins=begin,
            action=action,
            target=target,
            log_probability=log_probability,
            value=value,
            reward=reward,
            reached=reached,
            truncated=ended & ~reached,
            blocked=blocked,
            value_after=value_after,
        )

    def _step(self, action: Tensor, hidden: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Walk one step; what it earned, and where (N,) the target was reached, the episode ended, the move blocked.

        With what is remembered (N, H), episodes that are cut earn what their last pose is worth as well.
        """
        seen = self._features(self.navigation.state)
        step = self.navigation.step(action)
        likeness = self.pairs.likeness(self._features(step.state), seen)
        last, reward = last_step(action, likeness), step.reward
        if hidden is not None and step.truncated.any():
            worth = self.network(self._seen(), last, hidden).value
            reward = reward + self.learner.discount * torch.where(step.truncated, worth, 0.0)
        self.navigation.restart(step.ended)
        self.last = torch.where(step.ended[:, None], 0.0, last)
        return reward, step.reached, step.ended, step.blocked

    @torch.no_grad()
    def _seen(self) -> Tensor:
        """(N, D), what is seen beside the target."""
        target = self.world.target_state[self.navigation.target]
        return self.pairs(self._features(self.navigation.state), self._features(target))

    def _features(self, state: Tensor) -> Tensor:
        assert self.world.features is not None
        return self.world.features[state].float()

    def _fit(self) -> None:
        """Standardise what is seen by pairs of poses and targets drawn at random."""
        world = self.world
        drawn = Streams(torch.arange(FIT_PAIRS, device=world.device) + (self.seed << 32), FIT_STREAM)
        target = (drawn.uniform() * world.target_count).long()
        place = (drawn.uniform() * world.start_count[target]).long()
        start = world.start_state[world.start_offset[target] + place]
        self.pairs.fit(self._features(start), self._features(world.target_state[target]))

    def _shuffled(self, epoch: int) -> np.ndarray:
        return np.random.default_rng([self.seed, SHUFFLE_STREAM, self.updates, epoch]).permutation(self.learner.envs)

    def _count(self, walked: list) -> None:
        target, _, reached, ended, blocked = (torch.stack(part) for part in zip(*walked, strict=True))
        self.statistics.add(_Counted(target, reached, ended & ~reached, blocked))

    def _differentiate(self, loss: Tensor) -> None:
        for parameter in self.network.parameters():
            parameter.grad = None
        loss.backward()

    def _gradients(self) -> list[Tensor]:
        return [parameter.grad for parameter in self.network.parameters() if parameter.grad is not None]

    def fixed_tensors(self) -> dict[str, Tensor]:
        """The eyes that compare."""
        return joined({"pairs": self.pairs.tensors()})

    def close(self) -> None:
        """Nothing is held that would have to be given back; see `Learning` in `train`."""

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on bit for bit, besides `frames` and `updates`."""
        parts: dict[str, dict[str, Tensor]] = {
            "network": {name: p.data for name, p in self.network.named_parameters()},
            "optimiser": self.optimiser.tensors(),
            "navigation": self.navigation.tensors(),
            "statistics": self.statistics.tensors(),
            "memory": {"hidden": self.hidden, "last": self.last},
            "drawn": {name: stream.drawn for name, stream in self.streams.items()},
        }
        return {name: tensor.detach() for name, tensor in joined(parts).items()}

    @torch.no_grad()
    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """Go on from where `tensors` was called, after that many frames and updates."""
        here = self.world.device
        for name, parameter in self.network.named_parameters():
            parameter.copy_(tensors[f"network.{name}"])
        self.optimiser.load_tensors(part_of(tensors, "optimiser"))
        self.navigation.load_tensors(part_of(tensors, "navigation"))
        self.statistics.load_tensors(part_of(tensors, "statistics"))
        self.hidden, self.last = (tensors[f"memory.{name}"].to(here).clone() for name in ("hidden", "last"))
        for name, stream in self.streams.items():
            stream.seek(tensors[f"drawn.{name}"].to(here).clone())
        self.frames, self.updates = frames, updates


@dataclass(frozen=True)
class _Counted:
    """What `EpisodeStatistics` counts, (T, N) each."""

    target: Tensor
    reached: Tensor
    truncated: Tensor
    blocked: Tensor
