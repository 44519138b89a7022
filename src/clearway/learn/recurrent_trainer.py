"""The trainer of the recurrent agent: the planner teaches it, then PPO; one call an update. See `recurrent`.

Axis letters: T steps, N environments, D numbers of a pair, H width, A actions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import softplus

from clearway.learn.figures import Figures, check_finite
from clearway.learn.learner import geometric, linear
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.optimiser import Adam, clip_gradients
from clearway.learn.returns import generalised_advantages
from clearway.learn.rollout import ACTION_STREAM, sample_actions
from clearway.learn.statistics import EpisodeStatistics
from clearway.learn.teacher import Teacher
from clearway.model.pair_table import FIT_PAIRS, PairTable
from clearway.model.recurrent import LAST_COUNT, RecurrentActorCritic, RecurrentOutput, SeenPairs, last_step
from clearway.perception.eyes_network import Eyes
from clearway.reward import Reward
from clearway.world.navigation import Navigation, TargetChoice, Transition
from clearway.world.streams import Streams
from clearway.world.world import World

if TYPE_CHECKING:
    from clearway.learn.recurrent import Recurrent

FIT_STREAM, SHUFFLE_STREAM = 13, 14
STREAMS = {"actions": ACTION_STREAM, "teacher": 11, "who": 12}
VALUE_WEIGHT = 1.0


@dataclass(frozen=True)
class Walked:
    """T steps of N environments, and where targets were reached, R times.

    Attributes:
        pairs: (T, N, D), what was seen beside the target.
        last: (T, N, LAST_COUNT), of the step before.
        hidden: (N, H), what was remembered before the first step.
        begins: (T, N) bool, an episode begins with this step.
        best: (T, N, A) bool, what the teacher would do.
        action, target: (T, N) int64.
        log_probability, value: (T, N), by the policy that walked.
        reward: (T, N) float32.
        reached, truncated, blocked: (T, N) bool.
        value_after: (N,), of what is seen after the last step.
        there: (R, D + LAST_COUNT), what was seen at a target once it was reached, and of the step before.
    """

    pairs: Tensor
    last: Tensor
    hidden: Tensor
    begins: Tensor
    best: Tensor
    action: Tensor
    target: Tensor
    log_probability: Tensor
    value: Tensor
    reward: Tensor
    reached: Tensor
    truncated: Tensor
    blocked: Tensor
    value_after: Tensor
    there: Tensor


PolicyLoss: TypeAlias = Callable[[Walked, Tensor, Tensor, Tensor], tuple[Tensor, dict[str, Tensor]]]
"""Of what was walked, the environments (B,), log-probabilities (T, B, A) and advantages (T, B): a loss and figures."""


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
        drawn = torch.arange(FIT_PAIRS, dtype=torch.int64, device=device) + (seed << 32)
        self.seen = PairTable(world, self.pairs, Streams(drawn, FIT_STREAM))
        self.network = RecurrentActorCritic(learner.shape(self.pairs.count), seed).to(device)
        self.optimiser = Adam(dict(self.network.named_parameters()))
        self.teacher = Teacher(world, reward, learner.discount)
        seeds = torch.arange(count, dtype=torch.int64, device=device) + (seed << 32)
        scene = torch.arange(count, device=device) * world.scene_count // count
        choice = TargetChoice.by_scene(world, scene) if count >= world.scene_count else None
        self.navigation = Navigation(
            world, reward, seeds, choice=choice, step_limit=learner.step_limit, history_length=1
        )
        self.statistics = EpisodeStatistics(count, world.target_count, device)
        self.streams = {name: Streams(seeds, purpose) for name, purpose in STREAMS.items()}
        self.hidden = torch.zeros(count, learner.width, device=device)
        self.last = torch.zeros(count, LAST_COUNT, device=device)
        self.begins = torch.ones(count, dtype=torch.bool, device=device)
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
        learner, taught, frames = self.learner, self.learner.taught_frames, self.frames
        if self.is_taught:
            walked = self._walk(learner.teacher_share * (1 - frames / taught))
            lr = geometric(learner.taught_lr_start, learner.taught_lr_end, frames, taught)
            figures = self._learn(walked, 1, lr, self._taught_loss)
        else:
            walked, left = self._walk(), learner.frames - taught
            lr = geometric(learner.lr_start, learner.lr_end, frames - taught, left)
            entropy_weight = linear(learner.entropy_start, learner.entropy_end, frames - taught, left)
            figures = self._learn(walked, learner.epochs, lr, partial(self._paid_loss, entropy_weight))
        self.frames += learner.envs * learner.rollout_steps
        self.updates += 1
        check_finite(figures, self.frames)
        return figures

    def _learn(self, walked: Walked, epochs: int, lr: float, policy_loss: PolicyLoss) -> Figures:
        """Passes over T steps, each in minibatches of environments; means of the figures."""
        learner = self.learner
        discount = torch.where(walked.reached | walked.truncated, 0.0, learner.discount)
        advantage = generalised_advantages(
            walked.reward, discount, walked.value, walked.value_after, learner.gae_lambda
        )
        returns = advantage + walked.value
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-6)
        told = []
        for epoch in range(epochs):
            order = torch.from_numpy(self._shuffled(epoch)).to(self.world.device)
            for some in order.chunk(learner.minibatches):
                said = self.network.along(
                    walked.pairs[:, some], walked.last[:, some], walked.hidden[some], walked.begins[:, some]
                )
                loss, parts = policy_loss(walked, some, torch.log_softmax(said.scores, dim=2), advantage[:, some])
                parts["value_loss"] = (said.value - returns[:, some]).square().mean() / 2
                parts["arrival_loss"] = self._arrival_loss(walked, some, said)
                loss = loss + VALUE_WEIGHT * parts["value_loss"] + parts["arrival_loss"]
                for parameter in self.network.parameters():
                    parameter.grad = None
                loss.backward()
                norm = clip_gradients(self._gradients(), learner.clip_norm, each_tensor=False)
                self.optimiser.step(lr)
                told.append({"loss": loss, **parts, "gradient_norm": norm})
        means = torch.stack([torch.stack([figures[name] for name in told[0]]).detach() for figures in told]).mean(0)
        return {**dict(zip(told[0], means.tolist(), strict=True)), "lr": lr}

    def _taught_loss(
        self, walked: Walked, some: Tensor, log_probabilities: Tensor, advantage: Tensor
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """The policy's loss under the teacher, and its figures."""
        right = torch.where(walked.best[:, some], log_probabilities, -torch.inf).logsumexp(dim=2)
        return -right.mean(), {"agreement": right.exp().mean()}

    def _paid_loss(
        self, entropy_weight: float, walked: Walked, some: Tensor, log_probabilities: Tensor, advantage: Tensor
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """The policy's loss of PPO, and its figures."""
        taken = log_probabilities.gather(2, walked.action[:, some, None])[..., 0]
        ratio = (taken - walked.log_probability[:, some]).exp()
        clipped = ratio.clamp(1 - self.learner.ratio_clip, 1 + self.learner.ratio_clip)
        policy_loss = -torch.minimum(ratio * advantage, clipped * advantage).mean()
        entropy = -(log_probabilities.exp() * log_probabilities).sum(dim=2).mean()
        return policy_loss - entropy_weight * entropy, {"policy_loss": policy_loss, "entropy": entropy}

    def _arrival_loss(self, walked: Walked, some: Tensor, said: RecurrentOutput) -> Tensor:
        """Cross-entropy of whether this is the target: at no step on the way, and where it was reached."""
        step, env = walked.reached.nonzero(as_tuple=True)
        place = torch.full((self.learner.envs,), -1, device=env.device)
        place[some] = torch.arange(len(some), device=env.device)
        row = (place[env] >= 0).nonzero()[:, 0]
        remembered = said.hidden[step[row], place[env[row]]]
        pairs, last = walked.there[row].tensor_split([self.pairs.count], dim=1)
        there = self.network(pairs, last, remembered).arrived
        total = softplus(said.arrived).sum() + softplus(-there).sum()
        return total / (said.arrived.numel() + len(there))

    @torch.no_grad()
    def _walk(self, teachers_share: float = 0.0) -> Walked:
        """T steps by the policy, some of them by the teacher."""
        rows, there, hidden_first = [], [], self.hidden
        for _ in range(self.learner.rollout_steps):
            pairs, last, begins, target = self._seen(), self.last, self.begins, self.navigation.target
            best = self.teacher[target, self.navigation.state]
            said = self.network(pairs, last, self.hidden)
            action = sample_actions(said.scores, self.streams["actions"].uniform())
            if teachers_share > 0:
                teachers = sample_actions(torch.where(best, 0.0, -torch.inf), self.streams["teacher"].uniform())
                action = torch.where(self.streams["who"].uniform() < teachers_share, teachers, action)
            log_probability = torch.log_softmax(said.scores, dim=1).gather(1, action[:, None])[:, 0]
            reward, happened, arrived = self._step(action, said.hidden)
            there.append(arrived)
            did = (action, target, log_probability, said.value, reward)
            rows.append((pairs, last, begins, best, *did, happened.reached, happened.truncated, happened.blocked))
        value_after = self.network(self._seen(), self.last, self.hidden).value
        names = [field.name for field in fields(Walked) if field.name not in ("hidden", "value_after", "there")]
        steps = {name: torch.stack(part) for name, part in zip(names, zip(*rows, strict=True), strict=True)}
        walked = Walked(**steps, hidden=hidden_first, value_after=value_after, there=torch.cat(there))
        self.statistics.add(walked)
        return walked

    def _step(self, action: Tensor, remembered: Tensor) -> tuple[Tensor, Transition, Tensor]:
        """Walk one step; what it earned (N,), what happened, and what is seen where targets were reached.

        Episodes that are cut earn what their last pose is worth as well, by what is remembered (N, H).
        """
        before = self.navigation.sighting
        step = self.navigation.step(action)
        last = last_step(action, self.seen.likeness(self.navigation.sighting, before))
        reward = step.reward
        cut, reached = (flag.nonzero()[:, 0] for flag in (step.truncated, step.reached))
        if len(cut):
            worth = self.network(self._seen(cut), last[cut], remembered[cut]).value
            reward = reward.index_add(0, cut, self.learner.discount * worth)
        there = torch.cat([self._seen(reached), last[reached]], dim=1)
        self.navigation.restart(step.ended)
        self.last = torch.where(step.ended[:, None], 0.0, last)
        self.hidden = torch.where(step.ended[:, None], 0.0, remembered)
        self.begins = step.ended
        return reward, step, there

    def _seen(self, index: Tensor | None = None) -> Tensor:
        """(B, D), what is seen beside the target in the environments in index (B,), all by default."""
        rows = (self.navigation.target, self.navigation.sighting)
        return self.seen(*(rows if index is None else (part[index] for part in rows)))

    def _shuffled(self, epoch: int) -> np.ndarray:
        return np.random.default_rng([self.seed, SHUFFLE_STREAM, self.updates, epoch]).permutation(self.learner.envs)

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
            "memory": {"hidden": self.hidden, "last": self.last, "begins": self.begins},
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
        for name in ("hidden", "last", "begins"):
            setattr(self, name, tensors[f"memory.{name}"].to(here).clone())
        for name, stream in self.streams.items():
            stream.seek(tensors[f"drawn.{name}"].to(here).clone())
        self.frames, self.updates = frames, updates
