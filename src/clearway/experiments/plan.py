"""What to train and on what to try it: a job an agent, named by everything that determines the agent."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final, Literal, TypeAlias

from clearway.choices import ZoneLevel
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT
from clearway.learn.foreign_agent import is_ours
from clearway.learn.learner import Learner
from clearway.learn.old_runs import without_later
from clearway.learn.plugged import paid_by
from clearway.learn.seeds import check_seed
from clearway.live.conditions import Condition, Perturbations
from clearway.reward import Reward
from clearway.views.seen import TAKES

TargetSets = tuple[tuple[int, ...], ...]
"""Targets of each scene, in the scenes' order; states in the scene's own numbering."""

WalkerName: TypeAlias = Literal["agent", "nearest picture", "random walk"]
NEAREST: Final = "nearest picture"
RANDOM_WALK: Final = "random walk"

DIGEST_LENGTH = 10


@dataclass(frozen=True)
class SceneFile:
    """A scene of an experiment: its name, its file, and the digest of what training sees of it (`scene_digest`)."""

    name: str
    path: Path
    digest: str


@dataclass(frozen=True)
class PerturbedPictures:
    """Perturbed pictures of every pose, see `views.seen`.

    Attributes:
        perturbations: how strong they are.
        takes: of each pose.
    """

    perturbations: Perturbations
    takes: int = TAKES


@dataclass(frozen=True)
class PlannedRun:
    """An agent to be trained.

    Attributes:
        scenes: all of them train one agent.
        targets: of each scene.
        reward, learner, seed, zone_level: see there.
        perturbed: pictures that are seen beside the scenes' own; None: there are none.

    Raises:
        RunError: the seed is out of range.
    """

    scenes: tuple[SceneFile, ...]
    targets: TargetSets
    reward: Reward
    learner: Learner
    seed: int
    zone_level: ZoneLevel = "pose"
    perturbed: PerturbedPictures | None = None

    def __post_init__(self) -> None:
        check_seed(self.seed)
        object.__setattr__(self, "targets", _plain(self.targets))

    @property
    def paid(self) -> Reward:
        """The reward as training pays it, see `paid_by`."""
        return paid_by(self.learner, self.reward)

    @property
    def halfway(self) -> int:
        """Frames after half of the training; the agent is kept there too, see `RunFolder.milestone`."""
        return max(1, self.learner.frames // 2)

    @cached_property
    def kind(self) -> str:
        """What the speed of its training depends on: the learner's settings but its frames, and how many pictures."""
        takes = self.perturbed and self.perturbed.takes  # tables are as long as there are pictures
        return _as_json([self.learner.algorithm, asdict(replace(self.learner, frames=1)), takes])

    @cached_property
    def name(self) -> str:
        """Name of the run's folder: some of it for people, then the digest of all that determines the agent."""
        scenes = [(scene.name, scene.digest) for scene in self.scenes]
        settings = {"algorithm": self.learner.algorithm, **without_later(self.learner)}
        ours = all(map(is_ours, self.reward.terms))  # their values tell them apart
        paid = asdict(self.reward) if ours else self.reward.to_json()
        content: list[object] = [scenes, self.targets, paid, settings, self.seed]
        if self.zone_level != "pose":  # runs planned before keep their names
            content.append(self.zone_level)
        if self.perturbed is not None:
            content.append(asdict(self.perturbed))
        targets = sum(len(own) for own in self.targets)
        frames = f"{self.learner.frames / 1e6:g}M"
        return f"{self.learner.algorithm}-{self.reward.name}-{targets}t-{frames}-s{self.seed}-{_digest(content)}"


@dataclass(frozen=True)
class Trial:
    """Episodes to be walked on the grid: the paper's protocol on some targets.

    Attributes:
        targets: of each scene.
        halfway: try the agent as it was halfway through its training, not the trained one.
        episodes_per_target, step_limit: of the protocol.
        seed: of starts, sampled actions and perturbed pictures.
        perturbed: pictures that are seen on the way; None: the scenes' own.
        walker: the run's agent; or, by perturbed pictures, who goes by the nearest picture.
    """

    targets: TargetSets
    halfway: bool = False
    episodes_per_target: int = EPISODES_PER_TARGET
    step_limit: int = STEP_LIMIT
    seed: int = 0
    perturbed: PerturbedPictures | None = None
    walker: WalkerName = "agent"

    def __post_init__(self) -> None:
        object.__setattr__(self, "targets", _plain(self.targets))
        assert self.walker == "agent" or (self.walker == NEAREST and self.perturbed is not None), self.walker

    def targets_of(self, run: PlannedRun) -> TargetSets:
        """Its own, whatever the run was trained on."""
        del run
        return self.targets

    @property
    def episodes(self) -> int:
        """To each target."""
        return self.episodes_per_target

    @cached_property
    def name(self) -> str:
        """Name of its file in the run's folder."""
        content = asdict(self)
        if self.perturbed is None:  # trials planned before keep their names
            del content["perturbed"]
        if self.walker == "agent":
            del content["walker"]
        return f"{'halfway' if self.halfway else 'end'}-{sum(map(len, self.targets))}t-{_digest(content)}"


@dataclass(frozen=True)
class LiveTrial:
    """Episodes to be walked in the rooms themselves: to the targets trained on, under several settings.

    Attributes:
        settings: what is changed in the room, by label; see `live.conditions`.
        episodes_per_target, step_limit: of each setting.
        seed: of starts, sampled actions and chances.
        walker: the run's agent, or one that needs no training and is walked beside it.
    """

    settings: tuple[Condition, ...]
    episodes_per_target: int
    step_limit: int
    seed: int = 0
    walker: WalkerName = "agent"

    def targets_of(self, run: PlannedRun) -> TargetSets:
        """The run's."""
        return run.targets

    @property
    def episodes(self) -> int:
        """To each target, under all settings."""
        return self.episodes_per_target * len(self.settings)

    @cached_property
    def name(self) -> str:
        """Name of its file in the run's folder."""
        content = asdict(self)
        if self.walker == "agent":  # trials planned before keep their names
            del content["walker"]
        return f"live-{len(self.settings)}s-{_digest(content)}"


@dataclass(frozen=True)
class Job:
    """A run with its trials: what one worker does."""

    run: PlannedRun
    trials: tuple[Trial | LiveTrial, ...]


def targets_by_scene(scenes: Iterable[SceneFile], targets: TargetSets) -> dict[str, list[int]]:
    """Targets by the names of their scenes."""
    return {scene.name: list(own) for scene, own in zip(scenes, targets, strict=True)}


def told_of(run: PlannedRun, trial: Trial | LiveTrial) -> dict[str, object]:
    """What a file of a trial says it is about."""
    about = {"run": run.name, "targets": targets_by_scene(run.scenes, trial.targets_of(run)), "seed": trial.seed}
    if trial.walker != "agent":
        about["walker"] = trial.walker
    if isinstance(trial, Trial) and trial.perturbed is not None:
        about["perturbed"] = asdict(trial.perturbed)
    return {**about, "step_limit": trial.step_limit}


def _plain(targets: Iterable[Iterable[int]]) -> TargetSets:
    """Targets that may be numbers of NumPy's, which no JSON file takes, as Python's."""
    return tuple(tuple(int(target) for target in own) for own in targets)


def _digest(content: object) -> str:
    return hashlib.sha256(_as_json(content).encode()).hexdigest()[:DIGEST_LENGTH]


def _as_json(content: object) -> str:
    """Of JSON values, and numbers of NumPy's, as settings may hold."""
    return json.dumps(content, sort_keys=True, default=lambda number: number.item())


def merged(jobs: Iterable[Job]) -> list[Job]:
    """The same jobs, each run once with all its trials, in the order in which runs first occur."""
    found: dict[str, Job] = {}
    for job in jobs:
        known = found.get(job.run.name)
        trials = dict.fromkeys((*known.trials, *job.trials) if known else job.trials)
        found[job.run.name] = replace(job, trials=tuple(trials))
    return list(found.values())
