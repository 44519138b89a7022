"""Rollouts: all environments walk some steps under the current policy.

Axis letters: T steps, N environments, K history, A actions.
Environments are ordered by scene. What the network reads is kept as rows (N * T, ...), an environment's steps together,
so that rows are ordered by scene too; what returns are computed from is (T, N).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.model.lookup import Activations, LookupNetwork
from clearway.model.policy import sampled
from clearway.world.navigation import Navigation, Transition
from clearway.world.streams import Streams

ACTION_STREAM = 3


def sample_actions(scores: Tensor, uniform: Tensor) -> Tensor:
    """Actions (B,) int64 drawn from softmax(scores (B, A)) with uniform numbers (B,) in [0, 1)."""
    return sampled(torch.softmax(scores, 1, dtype=torch.float64), uniform)


def as_rows(values: Tensor) -> Tensor:
    """(T, N, ...) rearranged to (N * T, ...), each environment's steps together."""
    return values.transpose(0, 1).flatten(0, 1)


def by_step(rows: Tensor, steps: int) -> Tensor:
    """(N * T, ...) rearranged to (T, N, ...); the inverse of `as_rows`."""
    return rows.unflatten(0, (-1, steps)).transpose(0, 1)


@dataclass(frozen=True)
class Rollout:
    """T steps of N environments.

    Attributes:
        history: (T, N, K) int64, what the agent had seen before each step (`world.navigation`).
        target: (T, N) int64.
        action: (T, N) int64.
        arrived: (T, N) int64, the pose each step led to.
        reward: (T, N) float32 as the reward table has it.
        reached, truncated, blocked: (T, N) bool.
        last_history: (T, N, K) int64, the history after each step, before any new episode began.
        kept: activations of all rows, as `as_rows` orders them; only the output where they are not to be used again.
        history_after, target_after: (N, K), (N,) int64, where the environments stand now.
    """

    history: Tensor
    target: Tensor
    action: Tensor
    arrived: Tensor
    reward: Tensor
    reached: Tensor
    truncated: Tensor
    blocked: Tensor
    last_history: Tensor
    kept: Activations
    history_after: Tensor
    target_after: Tensor

    @property
    def steps(self) -> int:
        """T."""
        return len(self.action)


class Collector:
    """Gathers rollouts, one after the other.

    Args:
        navigation: the environments, ordered by scene.
        network: the policy.
        action_stream: one random stream an environment.
        envs_per_scene: number of environments of each scene.
        steps: T, where a rollout is not told otherwise.
        keep_hidden: keep the hidden activations too, for an update that follows at once.
    """

    def __init__(
        self,
        navigation: Navigation,
        network: LookupNetwork,
        action_stream: Streams,
        envs_per_scene: Sequence[int],
        steps: int,
        keep_hidden: bool,
    ) -> None:
        self.navigation, self.network, self.action_stream = navigation, network, action_stream
        self.keep_hidden = keep_hidden
        device, count = navigation.world.device, sum(envs_per_scene)
        self.rows_per_scene = tuple(envs_per_scene)
        self.one_step = Activations.empty(count, network.width, device, dtype=network.dtype)
        self._make_room(steps)

    def _make_room(self, steps: int) -> None:
        """Memory for rollouts of so many steps."""
        network, count = self.network, len(self.one_step.output)
        width = network.width if self.keep_hidden else 0
        self.steps = steps
        self.kept = Activations.empty(count * steps, width, self.one_step.output.device, dtype=network.dtype)
        # what each step is written to
        self.memory = self.kept.by_step(steps) if self.keep_hidden else [self.one_step] * steps

    @torch.no_grad()
    def collect(self, steps: int | None = None) -> Rollout:
        """Walk T steps, or so many, from where the environments stand; ended episodes begin anew at once."""
        nav = self.navigation
        if steps is not None and steps != self.steps:
            self._make_room(steps)
        seen: list[tuple[Tensor, Tensor, Tensor, Transition, Tensor]] = []
        for t in range(self.steps):
            history, target = nav.history, nav.target
            now = self.network.forward(history, target, self.rows_per_scene, self.memory[t])
            if not self.keep_hidden:
                by_step(self.kept.output, self.steps)[t] = now.output
            action = sample_actions(now.scores, self.action_stream.uniform())
            step = nav.step(action)
            seen.append((history, target, action, step, nav.history))
            nav.restart(step.ended)
        histories, targets, actions, happened, last_histories = zip(*seen, strict=True)
        return Rollout(
            history=torch.stack(histories),
            target=torch.stack(targets),
            action=torch.stack(actions),
            arrived=torch.stack([step.state for step in happened]),
            reward=torch.stack([step.reward for step in happened]),
            reached=torch.stack([step.reached for step in happened]),
            truncated=torch.stack([step.truncated for step in happened]),
            blocked=torch.stack([step.blocked for step in happened]),
            last_history=torch.stack(last_histories),
            kept=self.kept,
            history_after=nav.history,
            target_after=nav.target,
        )
