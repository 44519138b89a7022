"""The transition rule, for many episodes at once: table look-ups only. Every environment here rests on it.

Axis letters: N environments, K poses of history (newest last), M targets, G groups of targets.

An episode starts in a pose drawn uniformly from those that can reach the target, itself excluded; its history is that
pose K times. A blocked move leaves the agent where it is, and its repeated pose enters the history like any other. The
episode ends in the exact target pose (`reached`), or is cut at the step limit (`truncated`); see Zhu et al., ICRA 2017.
Where agents stop by themselves, it ends by the action `STOP`, in the target or elsewhere (`gave_up`).

Histories hold what was seen: the pose, or, where a world has several pictures of each (`World.sightings`), the row of
one of them, drawn at every step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from clearway.reward import Reward
from clearway.scenes.actions import STOP
from clearway.world.streams import Streams
from clearway.world.world import World

HISTORY_LENGTH = 4
START_STREAM, TARGET_STREAM, SIGHT_STREAM = 1, 2, 14


@dataclass(frozen=True)
class Transition:
    """What one step did, for each environment.

    Attributes:
        state: (N,) int64, the pose arrived in.
        reward: (N,) float32 (or the `reward_dtype` asked for).
        reached: (N,) bool, the pose is the target.
        truncated: (N,) bool, the step limit was met first.
        blocked: (N,) bool, the move was blocked: one collision.
        zone: (N,) int64, zone of the pose arrived in.
        gave_up: (N,) bool, the agent stopped elsewhere than in the target; None where there is no action to stop.
    """

    state: Tensor
    reward: Tensor
    reached: Tensor
    truncated: Tensor
    blocked: Tensor
    zone: Tensor
    gave_up: Tensor | None = None

    @property
    def ended(self) -> Tensor:
        """(N,) bool: the episode is over, either way."""
        ended = self.reached | self.truncated
        return ended if self.gave_up is None else ended | self.gave_up


class TargetChoice:
    """How a target is drawn for a new episode: by weight among the targets of the environment's group.

    Args:
        groups: (N,) int64, the group of each environment.
        members: (G, J) int64, targets of each group, padded with any target.
        weights: (G, J) float64, 0 at the padding; set anew at any time with `reweigh`.
    """

    def __init__(self, groups: Tensor, members: Tensor, weights: Tensor) -> None:
        self.groups, self.members = groups, members
        self.reweigh(weights)

    def reweigh(self, weights: Tensor) -> None:
        """Set the weights (G, J); 0 keeps a target from being drawn."""
        self.weights = weights
        total = weights.cumsum(1)
        self.bounds = total / total[:, -1:]  # the last bound is exactly 1, above every uniform number

    def draw(self, uniform: Tensor, index: Tensor | None = None) -> Tensor:
        """Targets (B,) int64 for the environments in index (B,), all by default, from uniform numbers (B,) below 1."""
        group = self.groups if index is None else self.groups[index]
        column = (uniform[:, None] >= self.bounds[group]).sum(1)
        return self.members[group, column]

    @classmethod
    def uniform(cls, world: World, env_count: int) -> TargetChoice:
        """Every environment draws from all targets of the world alike."""
        groups = torch.zeros(env_count, dtype=torch.int64, device=world.device)
        members = torch.arange(world.target_count, device=world.device)[None]
        return cls(groups, members, torch.ones(members.shape, dtype=torch.float64, device=world.device))

    @classmethod
    def by_scene(cls, world: World, env_scene: Tensor) -> TargetChoice:
        """Every environment draws from the targets of its scene, env_scene (N,) int64."""
        count = torch.bincount(world.target_scene, minlength=world.scene_count)
        first = count.cumsum(0) - count
        slot = torch.arange(int(count.max()), device=world.device)[None]
        members = torch.minimum(first[:, None] + slot, (first + count - 1)[:, None])
        return cls(env_scene, members, (slot < count[:, None]).to(torch.float64))


class Navigation:
    """N episodes side by side.

    Args:
        world: the tables.
        reward: what is earned.
        seeds: (N,) int64, one random stream an environment: environment i draws the same numbers in any batch.
        choice: how targets are drawn; by default uniformly from all.
        keep_targets: an environment keeps the target that it was last given and draws none; the first `reset` gives it.
        step_limit: steps after which an episode is truncated; None for no limit.
        history_length: K.
        reward_dtype: precision of the rewards.
        stop: a fifth action, `STOP`, ends an episode, and reaches the target where that is; nothing else does. It earns
            what a step earns that ends where it began.
    """

    def __init__(
        self,
        world: World,
        reward: Reward,
        seeds: Tensor,
        *,
        choice: TargetChoice | None = None,
        keep_targets: bool = False,
        step_limit: int | None = None,
        history_length: int = HISTORY_LENGTH,
        reward_dtype: torch.dtype = torch.float32,
        stop: bool = False,
    ) -> None:
        count = len(seeds)
        self.world, self.reward, self.step_limit = world, reward, step_limit
        self.choice, self.keep_targets = choice or TargetChoice.uniform(world, count), keep_targets
        moves, self.stop = world.moves(), stop
        table = torch.from_numpy(reward.table(moves))
        self._next_state, self._blocked = world.next_state, world.blocked
        if stop:
            stay = torch.arange(len(world.next_state), device=world.device)[:, None].to(world.next_state.dtype)
            self._next_state = torch.cat([world.next_state, stay], 1)
            self._blocked = torch.cat([world.blocked, torch.zeros_like(stay, dtype=torch.bool)], 1)
            staying = replace(
                moves, next_state=stay.expand(world.next_state.shape).cpu().numpy(), blocked=moves.blocked & False
            )
            table = torch.cat([table, torch.from_numpy(reward.table(staying))[..., :1]], 2)
        self.reward_table = table.to(world.device, reward_dtype)
        seeds = seeds.to(world.device)
        self.start_stream, self.target_stream = Streams(seeds, START_STREAM), Streams(seeds, TARGET_STREAM)
        self.sight_stream = Streams(seeds, SIGHT_STREAM)  # drawn from where poses have several pictures
        self.history = torch.zeros(count, history_length, dtype=torch.int64, device=world.device)
        self.target = torch.zeros(count, dtype=torch.int64, device=world.device)
        self.elapsed = torch.zeros(count, dtype=torch.int64, device=world.device)

    @property
    def state(self) -> Tensor:
        """(N,) int64, where every agent is."""
        return self.world.pose(self.sighting)

    @property
    def sighting(self) -> Tensor:
        """(N,) int64, what every agent sees: rows of features."""
        return self.history[:, -1]

    def reset(self, index: Tensor | None = None, target: Tensor | None = None, start: Tensor | None = None) -> None:
        """Begin new episodes.

        Args:
            index: (B,) int64, the environments that begin anew; None for all.
            target: (B,) int64, their targets; None to draw them, or to keep them.
            start: (B,) int64, their first states; None to draw them.
        """
        if index is None:
            index = torch.arange(len(self.target), device=self.world.device)
        if target is None:
            keep = self.keep_targets
            target = self.target[index] if keep else self.choice.draw(self.target_stream.at(index), index)
        if start is None:
            start = self._draw_start(self.start_stream.at(index), target)
        self.target[index] = target
        self.history[index] = self._seen(start, index)[:, None]
        self.elapsed[index] = 0

    def begin_staggered(self) -> None:
        """Begin all episodes, a group's targets in turn, with clocks spread so that cuts do not fall together.

        Targets of no weight are left out. Environments are ordered by group; there is a step limit.
        """
        assert self.step_limit is not None
        group, members = self.choice.groups, self.choice.members
        envs = torch.bincount(group, minlength=len(members))
        place = torch.arange(len(group), device=self.world.device) - (envs.cumsum(0) - envs)[group]
        drawn = self.choice.weights > 0
        members = members.gather(1, torch.argsort(~drawn, dim=1, stable=True))
        self.reset(target=members[group, place % drawn.sum(1)[group]])
        self.elapsed = (self.start_stream.uniform() * self.step_limit).long()

    def restart(self, ended: Tensor) -> None:
        """Begin new episodes where `ended` (N,) is True, as `reset` does, without telling the host where that is.

        Tensors are replaced, not written to.
        """
        target = self.target if self.keep_targets else self.choice.draw(self.target_stream.uniform(ended))
        start = self._draw_start(self.start_stream.uniform(ended), target)
        self.target = torch.where(ended, target, self.target)
        self.history = torch.where(ended[:, None], self._seen(start)[:, None], self.history)
        self.elapsed = torch.where(ended, 0, self.elapsed)

    def reseed(self, seeds: Tensor, index: Tensor) -> None:
        """Begin the streams of starts and targets of the environments in index (B,) anew, from seeds (B,) int64."""
        self.start_stream.reseed(seeds, index)
        self.target_stream.reseed(seeds, index)

    def step(self, action: Tensor) -> Transition:
        """Move every agent by its action (N,) int64 and say what happened. Ended episodes wait for their `reset`."""
        here = self.state
        arrived = self._next_state[here, action]
        blocked = self._blocked[here, action]
        reached = arrived == self.world.target_state[self.target]
        gave_up = None
        if self.stop:
            stopped = action == STOP
            reached, gave_up = reached & stopped, stopped & ~reached
        zone = self.world.zone[arrived]
        self.history = torch.cat([self.history[:, 1:], self._seen(arrived)[:, None]], 1)
        self.elapsed += 1
        limit_met = torch.zeros_like(reached) if self.step_limit is None else self.elapsed >= self.step_limit
        reward = self.earned(here, action, reached)
        over = reached if gave_up is None else reached | gave_up
        return Transition(arrived, reward, reached, limit_met & ~over, blocked, zone, gave_up)

    def earned(self, state: Tensor, action: Tensor, reached: Tensor) -> Tensor:
        """What actions (B,) earn in states (B,) int64, both, where they reach the target or not, (B,) bool."""
        return self.reward_table[reached.long(), state, action]

    def _seen(self, state: Tensor, index: Tensor | None = None) -> Tensor:
        """What is seen in states (B,) int64 of the environments in index (B,), all by default: rows of features."""
        count = self.world.sightings
        if count == 1:
            return state
        uniform = self.sight_stream.uniform() if index is None else self.sight_stream.at(index)
        return state * count + (uniform * count).long()

    def _draw_start(self, uniform: Tensor, target: Tensor) -> Tensor:
        rank = (uniform * self.world.start_count[target]).long()
        return self.world.start_state[self.world.start_offset[target] + rank]

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on from here."""
        return {
            "history": self.history,
            "target": self.target,
            "elapsed": self.elapsed,
            "starts_drawn": self.start_stream.drawn,
            "targets_drawn": self.target_stream.drawn,
            "sights_drawn": self.sight_stream.drawn,
        }

    def load_tensors(self, tensors: dict[str, Tensor]) -> None:
        """Go on from where `tensors` was called."""
        here = self.world.device
        self.history = tensors["history"].to(here).clone()
        self.target = tensors["target"].to(here).clone()
        self.elapsed = tensors["elapsed"].to(here).clone()
        self.start_stream.seek(tensors["starts_drawn"].to(here).clone())
        self.target_stream.seek(tensors["targets_drawn"].to(here).clone())
        if "sights_drawn" in tensors:  # not in checkpoints of before
            self.sight_stream.seek(tensors["sights_drawn"].to(here).clone())
