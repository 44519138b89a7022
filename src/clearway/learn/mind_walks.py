"""Walks in mind: from pose to pose as steps were seen to lead, with lessons of what would have been best.

Axis letters: N walks, T steps, B = T * N rows, K history, A actions, P pairs of a target and a state.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.learn.adapt import Adapt
from clearway.learn.losses import Batch
from clearway.learn.rollout import sample_actions
from clearway.learn.teacher import UNKNOWN, Teacher
from clearway.model.lookup import LookupNetwork
from clearway.model.sums import counted
from clearway.world.world import World


class MindWalks:
    """N walks under the network's policy, which begin in poses that were left before.

    Where no way to the target is known, what was not tried yet is best, and the walk is over. Else it is over at its
    target, where none is known any more, and after `step_limit` steps on average, by chance; an action of which nothing
    is known is replaced by a best one.

    Args:
        world: scenes and targets.
        network: the policy.
        seen: (S, A) int64, where actions lead, `UNKNOWN` where that was not seen.
        teacher: knows the best ways in what was seen, one at least.
        learner: the settings.
        generator: of all that is drawn.
    """

    def __init__(
        self,
        world: World,
        network: LookupNetwork,
        seen: Tensor,
        teacher: Teacher,
        learner: Adapt,
        generator: torch.Generator,
    ) -> None:
        self.world, self.network, self.seen, self.teacher = world, network, seen, teacher
        self.learner, self.generator = learner, generator
        self.pairs = torch.cat([teacher.pairs, self._lost()])
        self.target, self.history = self._begun(learner.mind_walks)

    @torch.no_grad()
    def lesson(self) -> tuple[Batch, Tensor]:
        """B rows of the next T steps, with best actions and their worth, and the mean probability of best actions."""
        steps = [self._step() for _ in range(self.learner.mind_steps)]
        history, target, action, log_pi, best = (torch.cat(part) for part in zip(*steps, strict=True))
        scene = self.world.target_scene[target]
        order = torch.argsort(scene, stable=True)
        history, target, action, log_pi, best = (part[order] for part in (history, target, action, log_pi, best))
        known, worth = self.teacher.has(target, history[:, -1]), self.teacher.value(target, history[:, -1])
        worth = torch.where(known, worth, 0.0) * self.learner.reward_scale
        batch = Batch(
            history,
            target,
            action,
            log_pi.gather(1, action[:, None])[:, 0],
            torch.zeros_like(log_pi[:, 0]),
            worth.to(log_pi.dtype),
            tuple(counted(scene, self.world.scene_count).tolist()),
            better=best / best.sum(1, keepdim=True),
        )
        return batch, (log_pi.exp() * best).sum(1).mean()

    def _step(self) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """One step of every walk: history (N, K), target (N,), action (N,), log pi (N, A) and best actions (N, A)."""
        order = torch.argsort(self.world.target_scene[self.target], stable=True)
        history, target = self.history[order], self.target[order]
        rows = counted(self.world.target_scene[target], self.world.scene_count).tolist()
        scores, _ = self.network.judged(history, target, rows)
        action, here = sample_actions(scores, self._uniform(len(target))), history[:, -1]
        known, tried = self.teacher.has(target, here), self.seen[here] != UNKNOWN
        best = torch.where(known[:, None], self.teacher[target, here], ~tried)
        action = torch.where(tried.gather(1, action[:, None])[:, 0], action, best.int().argmax(1))
        arrived = torch.where(known, self.seen[here, action], here)
        over = ~self.teacher.has(target, arrived) | (self._uniform(len(target)) < 1 / self.learner.step_limit)
        anew, begun = self._begun(len(target))
        onward = torch.cat([history[:, 1:], arrived[:, None]], 1)
        self.target = torch.where(over, anew, target)
        self.history = torch.where(over[:, None], begun, onward)
        return history, target, action, torch.log_softmax(scores, 1), best.to(scores.dtype)

    def _lost(self) -> Tensor:
        """(P, 2) targets and states that were left before, without a known way, where not all was tried."""
        world = self.world
        start = world.start_state
        target = torch.arange(world.target_count, device=world.device).repeat_interleave(world.start_count)
        tried = self.seen[start] != UNKNOWN
        lost = ~self.teacher.has(target, start) & tried.any(1) & ~tried.all(1)
        return torch.stack([target[lost], start[lost]], 1)

    def _begun(self, count: int) -> tuple[Tensor, Tensor]:
        """Targets (count,) and histories (count, K) of walks that begin."""
        place = (self._uniform(count) * len(self.pairs)).long()
        target, start = self.pairs[place].unbind(1)
        return target, start[:, None].expand(-1, self.learner.history_length)

    def _uniform(self, count: int) -> Tensor:
        """(count,) float64 in [0, 1)."""
        return torch.rand(count, generator=self.generator, dtype=torch.float64, device=self.world.device)
