"""Agents of one kind: the same but for the seed, tried on the same targets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearway.agents.by_pose import RandomWalk
from clearway.evaluation.across_seeds import failed_targets, mean_estimate
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.evaluation.metrics import METRIC_NAMES, by_scene, by_target
from clearway.experiments.job import episodes_of
from clearway.experiments.plan import Job, PlannedRun, TargetSets, Trial
from clearway.experiments.section import Value
from clearway.experiments.setting import Setting
from clearway.reward import BUMP, CLEARANCE, COLLISION_AWARE, SHORTEST, Reward
from clearway.world.world import World

PAIR: tuple[Reward, ...] = (SHORTEST, COLLISION_AWARE)
"""The two rewards that the paper compares."""
PAIR_AND_RIVALS: tuple[Reward, ...] = (SHORTEST, BUMP, COLLISION_AWARE, CLEARANCE)
"""`PAIR` and two rivals, compared where agents see other pictures than in training: off the grid, and perturbed."""
REWARD_PAIRS = ((COLLISION_AWARE, SHORTEST), (COLLISION_AWARE, BUMP), (CLEARANCE, SHORTEST))
"""Of which it is claimed there that the first collides less than the second."""
EXACT = "exact"
WALKED = "walked"
"""What tables call the learner of figures that are computed, and of those of an agent that learns nothing."""


@dataclass(frozen=True)
class Group:
    """Runs that differ in their seed alone, and a trial of each.

    Attributes:
        learner: its name.
        agent: the rest of what tells it from others, for example the reward.
        runs: one a seed.
        trial: what they are tried on.
    """

    learner: str
    agent: str
    runs: tuple[PlannedRun, ...]
    trial: Trial

    def jobs(self) -> list[Job]:
        """What must be done for the group."""
        return [Job(run, (self.trial,)) for run in self.runs]

    def scores(self, out: Path, target_count: int) -> Scores:
        """The figures of the runs that are complete."""
        return scores_of(out, self.jobs(), target_count)


@dataclass(frozen=True)
class Scores:
    """Figures of some agents.

    Attributes:
        seeds: R of them.
        values: (R, M, J) seeds, targets, metrics as in `METRIC_NAMES`.
    """

    seeds: tuple[int, ...]
    values: np.ndarray

    def __len__(self) -> int:
        """R."""
        return len(self.seeds)

    def of(self, metric: str) -> np.ndarray:
        """(R, M)."""
        return self.values[:, :, METRIC_NAMES.index(metric)]

    def in_scenes(self, metric: str, target_scene: np.ndarray) -> np.ndarray:
        """(R, C) means over each scene's targets; target_scene: (M,) int."""
        return by_scene(self.of(metric)[..., None], target_scene)[..., 0]

    def detours(self, target_scene: np.ndarray) -> np.ndarray:
        """(R, C) steps in each scene over the shortest paths'; target_scene: (M,) int."""
        return self.in_scenes("steps", target_scene) / self.in_scenes("shortest_path_steps", target_scene)

    def failed(self) -> str | None:
        """How many targets some episode did not reach, of those of all seeds; None where nothing is complete."""
        return failed_targets(self.of("success")) if len(self) else None

    def estimates(self, metrics: Iterable[str], target_scene: np.ndarray) -> list[Value]:
        """Cells of a table: each metric's mean over seeds, then its interval; None where nothing is complete.

        target_scene: (M,) int.
        """
        if not len(self):
            return [None for _ in metrics for _ in range(2)]
        found = [mean_estimate(self.of(metric), target_scene) for metric in metrics]
        return [value for each in found for value in (each.value, each.ends)]


def of_same_seeds(each: Sequence[Scores]) -> list[Scores]:
    """Of each the seeds that all have, in one order."""
    seeds = [seed for seed in each[0].seeds if all(seed in other.seeds for other in each)]
    return [Scores(tuple(seeds), one.values[[one.seeds.index(seed) for seed in seeds]]) for one in each]


def scores(tables: Mapping[int, EpisodeTable], target_count: int) -> Scores:
    """The figures of tables by seed, all over the same targets."""
    values = [by_target(table, target_count) for table in tables.values()]
    return Scores(tuple(tables), np.stack(values) if values else np.empty((0, target_count, len(METRIC_NAMES))))


def scores_of(out: Path, jobs: Iterable[Job], target_count: int) -> Scores:
    """The figures of the jobs that are complete, one a seed, each with one trial on the grid."""
    found = {}
    for job in jobs:
        (trial,) = job.trials
        assert isinstance(trial, Trial)
        if (table := episodes_of(out, job.run, trial)) is not None:
            found[job.run.seed] = table
    return scores(found, target_count)


def random_walk(world: World, trial: Trial) -> Scores:
    """The random walk's figures on the world's targets, under the trial's protocol."""
    table = run_episodes(
        world,
        RandomWalk(),
        episodes_per_target=trial.episodes_per_target,
        step_limit=trial.step_limit,
        seed=trial.seed,
    )
    return scores({0: table}, world.target_count)


def compared(
    setting: Setting,
    rewards: Sequence[Reward],
    *,
    targets: TargetSets | None = None,
    tried_on: TargetSets | None = None,
    frames_factor: float = 1,
    halfway: bool = False,
    step_limit: int | None = None,
) -> list[Group]:
    """A group for each learner and reward.

    Args:
        setting: see there.
        rewards: to be compared.
        targets: to be trained on; None: the paper's.
        tried_on: to be tried on; None: those trained on.
        frames_factor: multiplies the learners' frames.
        halfway: try the agents halfway through their training, not in the end.
        step_limit: end the trial's episodes sooner than the budget does.
    """
    found = []
    for name, learner in setting.learners.items():
        for reward in rewards:
            runs = setting.runs(learner, reward, targets, frames_factor)
            trial = setting.trial(targets if tried_on is None else tried_on, halfway=halfway, step_limit=step_limit)
            found.append(Group(name, reward.name, runs, trial))
    return found


def all_jobs(groups: Iterable[Group]) -> list[Job]:
    """What must be done for some groups."""
    return [job for group in groups for job in group.jobs()]
