"""The workers of one process: they walk a segment each, learn from it, and update the shared parameters in turn.

A round is one segment of every worker. All of them act on the copy of the parameters that the process took as the round
began, as threads of A3C do that take their copies at the same moment; then each worker's own gradient, clipped on its
own, goes into the shared parameters as an update of its own, one after the other.

Axis letters: R workers of this process (ordered by scene), T steps, K history, M targets, A actions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.learn.a3c.config import A3C
from clearway.learn.a3c.gradients import clip_scales, clipped, squared_norms, window_rows
from clearway.learn.a3c.own_copy import LocalNetwork
from clearway.learn.a3c.rmsprop import SharedRMSPropUpdate
from clearway.learn.figures import Figures
from clearway.learn.losses import Batch, LossSettings, LossTerms, loss_gradient
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.returns import generalised_advantages
from clearway.learn.rollout import ACTION_STREAM, sample_actions
from clearway.learn.statistics import COLLISIONS, EPISODES, REACHED, STEPS
from clearway.model.network import NetworkShape
from clearway.reward import Reward
from clearway.world.navigation import Navigation, TargetChoice, Transition
from clearway.world.streams import Streams
from clearway.world.world import World


@dataclass(frozen=True)
class WorkerSegments:
    """What R workers saw in up to T steps each.

    Attributes:
        reward: (T, R) float32, 0 after a worker's segment ended.
        action: (T, R) int64.
        walked: (T, R) bool, the step was taken.
        ended: (T, R) bool, the episode ended with this step.
        cut: (R,) bool, the segment ended with an episode cut at the step limit.
    """

    reward: Tensor
    action: Tensor
    walked: Tensor
    ended: Tensor
    cut: Tensor

    @property
    def length(self) -> Tensor:
        """(R,) int64, steps taken."""
        return self.walked.sum(0)


@dataclass(frozen=True)
class Round:
    """What a round was like.

    Attributes:
        frames: steps taken by all workers together.
        updates: of the shared parameters: one a worker.
        totals: (M, 4) float64 of the episodes that ended, columns as in `EpisodeStatistics.totals`.
        figures: means over the workers' updates.
    """

    frames: int
    updates: int
    totals: Tensor
    figures: Figures


class WorkerGroup:
    """R workers and their episodes.

    Args:
        world: tables with *prepared* features.
        learner, reward, seed: see there.
        workers: (R,) int64 numbers of the workers, their targets ascending. Worker i begins with target i modulo M.
        parameters: shared, by name.
        squares: shared mean squares plus epsilon of the parameters, by name.
    """

    def __init__(
        self,
        world: World,
        learner: A3C,
        reward: Reward,
        seed: int,
        workers: Tensor,
        parameters: Mapping[str, Tensor],
        squares: Mapping[str, Tensor],
    ) -> None:
        assert world.features is not None
        self.world, self.learner = world, learner
        self.parameters, self.squares = parameters, squares
        target = workers % world.target_count
        scene = world.target_scene[target]
        assert bool((scene.diff() >= 0).all()), "workers must be ordered by scene"
        self.rows_per_scene = torch.bincount(scene, minlength=world.scene_count).tolist()
        shape = NetworkShape(world.scene_count, world.features.shape[1], learner.width, learner.history_length)
        self.local = LocalNetwork(shape, world.features, self.rows_per_scene, learner.rollout_steps)
        self.optimiser = SharedRMSPropUpdate()
        seeds = workers + (seed << 32)
        self.navigation = Navigation(
            world,
            reward,
            seeds,
            choice=TargetChoice.by_scene(world, scene),
            keep_targets=learner.episode_targets == "kept",
            step_limit=learner.step_limit,
            history_length=learner.history_length,
        )
        self.action_stream = Streams(seeds, ACTION_STREAM)
        self.open_collisions = torch.zeros(len(workers), dtype=torch.float64)
        self.navigation.reset(target=target)

    @torch.no_grad()
    def round(self, frames: int) -> Round:
        """One segment and one update of every worker; `frames` have been used by all workers so far."""
        learner = self.learner
        self.local.copy(self.parameters)
        totals = torch.zeros(self.world.target_count, 4, dtype=torch.float64)
        segments = self._walk(totals)
        length = segments.length
        rates = [learner.lr_at(frames + count) for count in (length.cumsum(0) - length).tolist()]
        weight = learner.entropy_weight_at(frames)
        settings = LossSettings(weight, learner.value_weight, math.inf, sum_loss=True)  # means: segment by segment
        terms, gradient, explained = self._loss(segments, settings)
        norm = self._update(gradient, rates)
        steps, updates = int(length.sum()), len(rates)
        figures = {
            "loss": float(terms.total) / (updates if learner.sum_loss else steps),
            "policy_loss": float(terms.policy),
            "value_loss": float(terms.value),
            "entropy": float(terms.entropy),
            "gradient_norm": norm,
            "explained_variance": explained,
            "lr": rates[0],
            "entropy_weight": weight,
        }
        return Round(steps, updates, totals, figures)

    def _walk(self, totals: Tensor) -> WorkerSegments:
        """Walk until T steps are taken or the episode ends; new episodes begin at once, to be walked in next round."""
        nav, steps = self.navigation, self.learner.rollout_steps
        shape = steps, len(nav.target)
        reward, action = torch.zeros(shape), torch.zeros(shape, dtype=torch.int64)
        walked, ended = torch.zeros(shape, dtype=torch.bool), torch.zeros(shape, dtype=torch.bool)
        cut = torch.zeros(shape[1], dtype=torch.bool)
        walking = torch.ones(shape[1], dtype=torch.bool)
        self.local.begin(nav.history, self.world.target_state[nav.target])
        for t in range(steps):
            scores = self.local.output_at(t)[:, : self.world.next_state.shape[1]]
            action[t] = sample_actions(scores, self.action_stream.uniform(used=walking))
            step = self._step(action[t], walking)
            self._count(step, walking, totals)
            reward[t], walked[t], ended[t] = step.reward * walking, walking, step.ended & walking
            cut |= step.truncated & walking
            self.local.arrive(t + 1, step.state)
            walking = walking & ~step.ended
        self.local.output_at(steps)
        nav.reset(torch.nonzero(~walking)[:, 0])
        return WorkerSegments(reward, action, walked, ended, cut)

    def _step(self, action: Tensor, walking: Tensor) -> Transition:
        """Move the workers that still walk; the others stay as they are (their part of the result means nothing)."""
        nav = self.navigation
        history, elapsed = nav.history, nav.elapsed.clone()
        step = nav.step(action)
        nav.history = torch.where(walking[:, None], nav.history, history)
        nav.elapsed = torch.where(walking, nav.elapsed, elapsed)
        return step

    def _count(self, step: Transition, walking: Tensor, totals: Tensor) -> None:
        """Add the episodes that ended with this step to the totals."""
        self.open_collisions += step.blocked & walking
        ended = step.ended & walking
        if ended.any():
            rows = torch.zeros(int(ended.sum()), 4, dtype=torch.float64)
            rows[:, EPISODES] = 1
            rows[:, REACHED] = step.reached[ended].double()
            rows[:, STEPS] = self.navigation.elapsed[ended].double()
            rows[:, COLLISIONS] = self.open_collisions[ended]
            totals.index_add_(0, self.navigation.target[ended], rows)
            self.open_collisions[ended] = 0

    def _loss(self, segments: WorkerSegments, settings: LossSettings) -> tuple[LossTerms, Tensor, float]:
        """The loss of all steps taken, its gradient (R, T, A + 1), and the explained variance of the values."""
        learner, taken = self.learner, segments.walked
        output = self.local.output.transpose(0, 1)  # (T + 1, R, A + 1)
        value = output[..., -1]
        # a segment of fewer than T steps ended its episode, so nothing behind its last step counts
        advantage = generalised_advantages(
            segments.reward + self._value_at_cuts(segments, value),
            learner.discount * (~segments.ended).float(),
            value[:-1],
            value[-1],
            learner.gae_lambda,
        )
        action, scores = segments.action[taken], output[:-1][taken]
        batch = Batch(
            history=self.navigation.history[:0],
            target=self.navigation.target[:0],
            action=action,
            log_prob=torch.log_softmax(scores[:, :-1], 1).gather(1, action[:, None])[:, 0],
            advantage=advantage[taken],
            value_target=(advantage + value[:-1])[taken],
            rows_per_scene=(),
        )
        terms, gradient = loss_gradient(scores, batch, settings)
        placed = torch.zeros_like(output[:-1])
        placed[taken] = gradient
        if not learner.sum_loss:
            placed /= segments.length[:, None]
        explained = 1 - batch.advantage.var(correction=0) / batch.value_target.var(correction=0).clamp_min(1e-12)
        return terms, placed.transpose(0, 1), float(explained)

    def _value_at_cuts(self, segments: WorkerSegments, value: Tensor) -> Tensor:
        """(T, R) discounted value of the pose where an episode was cut, to be added to that step's reward; else 0."""
        bonus = torch.zeros_like(segments.reward)
        if self.learner.bootstrap_cut:
            worker = torch.nonzero(segments.cut)[:, 0]
            length = segments.length[worker]
            bonus[length - 1, worker] = self.learner.discount * value[length, worker]
        return bonus

    def _update(self, gradient: Tensor, rates: list[float]) -> float:
        """Every worker's update of the shared parameters; returns the mean norm of the gradients before clipping."""
        learner, optimiser, local = self.learner, self.optimiser, self.local
        factors, poses = local.backward(gradient), local.trail_features
        squares = squared_norms(factors, poses, learner.history_length)
        scales = clip_scales(squares, learner.clip_norm, learner.clip_each_tensor)
        factors, dense = clipped(factors, scales)

        def weight(name: str, place: int, left: Tensor, right: Tensor, lr: list[float]) -> None:
            optimiser.low_rank(self.parameters[name][place], self.squares[name][place], left, right, lr)

        for slot, rows in enumerate(window_rows(learner.history_length, learner.rollout_steps)):
            weight("siamese_weight", slot, factors.siamese, poses[:, rows], rates)
        weight("fusion_weight", 0, factors.fusion, factors.seen, rates)
        weight("fusion_weight", 1, factors.term, factors.wanted, rates)
        for scene, workers in local.heads:
            weight("scene_weight", scene, factors.scene[workers], factors.fused[workers], rates[workers])
            for name in ("scene_bias", "output_weight", "output_bias"):
                shared = self.parameters[name][scene], self.squares[name][scene]
                optimiser.dense(*shared, dense[name][workers], rates[workers])
        for name in ("siamese_bias", "fusion_bias"):
            optimiser.dense(self.parameters[name], self.squares[name], dense[name], rates)
        return float(torch.stack(list(squares.values())).sum(0).sqrt().mean())

    def tensors(self) -> dict[str, Tensor]:
        """What `load_tensors` needs of these workers to go on bit for bit, a row a worker, beside the parameters."""
        return {
            **joined({"navigation": self.navigation.tensors()}),
            "actions.drawn": self.action_stream.drawn,
            "open_collisions": self.open_collisions,
        }

    def load_tensors(self, tensors: Mapping[str, Tensor]) -> None:
        """Go on from where `tensors` was called."""
        self.navigation.load_tensors(part_of(tensors, "navigation"))
        self.action_stream.seek(tensors["actions.drawn"].clone())
        self.open_collisions = tensors["open_collisions"].clone()
