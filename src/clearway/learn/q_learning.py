"""Tabular Q-learning on poses (Watkins & Dayan, 1992): a yardstick that sees no picture and cannot generalise.

A table holds a value for every target, pose of the target's scene and action:

    Q(s, a) <- Q(s, a) + step_size (r + discount max_b Q(s', b) - Q(s, a)),

the target's own value being 0; where an episode is cut it counts as going on. Steps of several environments into the
same cell move it by the mean of their errors. Values begin at 0, which is more than steps are worth, so untried actions
are tried.

Axis letters: N environments, T steps, M targets, R rows (a target and a pose of its scene), A actions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import torch
from torch import Tensor

from clearway.agents.by_pose import PoseAgent
from clearway.errors import RunError
from clearway.learn.described import described
from clearway.learn.figures import Figures, check_finite
from clearway.learn.learner import Learner, linear, next_steps
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.rollout import ACTION_STREAM
from clearway.learn.statistics import EpisodeStatistics
from clearway.model.policy import sampled
from clearway.reward import Reward
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.navigation import Navigation
from clearway.world.streams import Streams
from clearway.world.world import World

if TYPE_CHECKING:
    from clearway.learn.run_record import RunRecord


@dataclass(frozen=True)
class QLearning(Learner):
    """Tabular Q-learning on poses; scenes need no features."""

    algorithm: ClassVar[str] = "q-learning"
    acts_on: ClassVar[str] = "table"

    frames: int = 1_000_000
    """Training frames over all environments; schedules end here."""
    envs: int = 100
    """Environments side by side; each draws its targets from all."""
    rollout_steps: int = 20
    """Steps of every environment that count as an update; the table is written after every step."""
    step_limit: int = 200
    """Steps after which a training episode is cut."""
    clip_rewards: bool = False
    """Clip rewards to [-1, 1]."""
    discount: float = 0.99
    step_size: float = 1.0
    """Share of the error by which a value moves; 1, since the same action in the same pose does the same."""
    explore_start: float = 1.0
    explore_end: float = 0.02
    """The share of actions drawn evenly falls linearly from start to end; the others are the best known."""

    def trainer(self, world: World, reward: Reward, seed: int) -> TableTrainer:
        """A trainer at its first frame."""
        return TableTrainer(world, self, reward, seed)

    def agent(self, record: RunRecord, tensors: Mapping[str, Tensor], frames: int) -> TrainedTable:
        """The agent of a run from the tensors of its checkpoint, after that many frames."""
        return TrainedTable(record, tensors["table.values"], frames)


class TableTrainer:
    """Learns a table for a world.

    Args:
        world: tables of the scenes and targets.
        learner: the settings.
        reward: what is earned.
        seed: of environments and actions.
    """

    def __init__(self, world: World, learner: QLearning, reward: Reward, seed: int) -> None:
        self.world, self.learner = world, learner
        self.frames, self.updates = 0, 0
        self.first_row, rows = table_rows(world.scene_offset, world.target_scene)
        self.values = torch.zeros(rows, ACTION_COUNT, device=world.device)
        seeds = torch.arange(learner.envs, dtype=torch.int64, device=world.device) + (seed << 32)
        self.navigation = Navigation(
            world, reward, seeds, step_limit=learner.step_limit, history_length=learner.history_length
        )
        self.action_stream = Streams(seeds, ACTION_STREAM)
        self.statistics = EpisodeStatistics(learner.envs, world.target_count, world.device)
        self.navigation.reset()

    @property
    def finished(self) -> bool:
        """All frames of the settings are used."""
        return self.frames >= self.learner.frames

    @torch.no_grad()
    def update(self) -> Figures:
        """Walk some steps and learn from each; returns figures of them, see docs/metrics.md.

        Raises:
            RunError: a value is not finite.
        """
        learner, nav = self.learner, self.navigation
        explore = linear(learner.explore_start, learner.explore_end, self.frames, learner.frames)
        walked: list[tuple[Tensor, ...]] = []
        errors: list[Tensor] = []
        steps = next_steps(self.frames, learner.frames, learner.envs, learner.rollout_steps)
        for _ in range(steps):
            target = nav.target
            row = self.first_row[target] + nav.state
            probabilities = explore / ACTION_COUNT + (1 - explore) * best_actions(self.values[row])
            action = sampled(probabilities, self.action_stream.uniform())
            step = nav.step(action)
            onward = self.values[self.first_row[target] + step.state].max(1).values  # at the target, never left, 0
            errors.append(self._learn(row * ACTION_COUNT + action, step.reward + learner.discount * onward))
            walked.append((target, step.reached, step.truncated, step.blocked))
            nav.restart(step.ended)
        self.statistics.add(WalkedSteps(*(torch.stack(column) for column in zip(*walked, strict=True))))
        self.frames += learner.envs * steps
        self.updates += 1
        result = {"value_error": float(torch.stack(errors).mean()), "explore": explore}
        check_finite(result, self.frames)
        return result

    def _learn(self, cell: Tensor, wanted: Tensor) -> Tensor:
        """Move the values of cells (N,) int64 towards `wanted` (N,); returns the mean absolute error, a scalar."""
        table = self.values.view(-1)
        error = wanted - table[cell]
        cells, place, count = cell.unique(return_inverse=True, return_counts=True)
        total = torch.zeros(len(cells), device=error.device).index_add_(0, place, error)
        table[cells] += self.learner.step_size * total / count
        return error.abs().mean()

    def fixed_tensors(self) -> dict[str, Tensor]:
        """Nothing: the table is all that an agent needs."""
        return {}

    def close(self) -> None:
        """Nothing is held that would have to be given back; see `Learning` in `train`."""

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on bit for bit, besides `frames` and `updates`."""
        return joined(
            {
                "table": {"values": self.values},
                "navigation": self.navigation.tensors(),
                "statistics": self.statistics.tensors(),
                "actions": {"drawn": self.action_stream.drawn},
            }
        )

    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """Go on from where `tensors` was called, after that many frames and updates."""
        self.values.copy_(tensors["table.values"])
        self.navigation.load_tensors(part_of(tensors, "navigation"))
        self.statistics.load_tensors(part_of(tensors, "statistics"))
        self.action_stream.seek(tensors["actions.drawn"].to(self.world.device).clone())
        self.frames, self.updates = frames, updates


@dataclass(frozen=True)
class WalkedSteps:
    """What `EpisodeStatistics` counts of T steps of N environments: target (T, N) int64, the others (T, N) bool."""

    target: Tensor
    reached: Tensor
    truncated: Tensor
    blocked: Tensor


@dataclass(frozen=True)
class TrainedTable:
    """A table with what it needs to act.

    Attributes:
        record: of its run.
        values: (R, A).
        frames: it has learnt from.
    """

    record: RunRecord
    values: Tensor
    frames: int

    def __repr__(self) -> str:
        return described(self)

    def on_poses(self, world: World) -> PoseAgent:
        """Its agent on the grid, which takes the best known actions alike, to targets of the run in the run's scenes.

        Raises:
            RunError: the scenes or targets are others.
        """
        names = tuple(scene.name for scene in self.record.scenes)
        if world.scene_names != names:
            raise RunError(f"the scenes are {world.scene_names}, but the agent's {names}. Give those, in this order")
        learnt = [(scene, state) for scene, own in enumerate(self.record.scenes) for state in own.targets]
        wanted = [(int(scene), world.scene_state(target)) for target, scene in enumerate(world.target_scene)]
        for scene, state in wanted:
            if (scene, state) not in learnt:
                known = ", ".join(str(state) for of, state in learnt if of == scene)
                raise RunError(f"{names[scene]}: no table for target {state}. Give a target it was trained on: {known}")
        scenes = torch.tensor([scene for scene, _ in learnt], device=world.device)
        first_row, rows = table_rows(world.scene_offset, scenes)
        if self.values.shape != (rows, ACTION_COUNT):
            raise RunError(
                f"the table has shape {tuple(self.values.shape)}, expected {(rows, ACTION_COUNT)}. Train again"
            )
        first_row = first_row[torch.tensor([learnt.index(one) for one in wanted], device=world.device)]
        values = self.values.to(world.device)

        def rule(history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
            row = values[first_row[target] + history[:, -1]]
            return best_actions(row), row.max(1).values

        return PoseAgent(world, rule)


def table_rows(scene_offset: Tensor, target_scene: Tensor) -> tuple[Tensor, int]:
    """What to add to a state for its row in a table of each target's poses, and the number of rows R.

    Args:
        scene_offset: (C + 1,) int64, first state of each scene.
        target_scene: (M,) int64, ascending.

    Returns:
        (M,) int64, and R.
    """
    states = torch.diff(scene_offset)[target_scene]
    return states.cumsum(0) - states - scene_offset[target_scene], int(states.sum())


def best_actions(values: Tensor) -> Tensor:
    """Probabilities (B, A) float64, uniform over the actions of the highest value, from values (B, A)."""
    best = (values == values.max(1, keepdim=True).values).to(torch.float64)
    return best / best.sum(1, keepdim=True)
