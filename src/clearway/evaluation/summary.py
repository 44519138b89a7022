"""`Evaluation`: what an agent's episodes come to, per target, scene and on average, with intervals.

Axis letters: J metrics, M targets, C scenes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from clearway.agents.selection import ActionSelection
from clearway.choices import ZoneLevel
from clearway.evaluation import bootstrap, metrics
from clearway.evaluation.episodes import EpisodeTable
from clearway.reward import Reward
from clearway.world.world import World

Interval = tuple[float, float]


@dataclass(frozen=True)
class Protocol:
    """How the episodes were walked."""

    episodes_per_target: int
    step_limit: int
    seed: int
    action_selection: ActionSelection


@dataclass(frozen=True)
class Trained:
    """What an agent was trained with.

    Attributes:
        frames: it has learnt from.
        seed: of its training.
        reward: as training paid it.
        zone_level: whose zones the reward spoke of.
    """

    frames: int
    seed: int
    reward: Reward
    zone_level: ZoneLevel

    def __str__(self) -> str:
        return f"{self.frames:,} frames, seed {self.seed}, reward {self.reward}, zones of {self.zone_level}s"

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {**vars(self), "reward": self.reward.to_json()}


@dataclass(frozen=True)
class Result:
    """Metrics of a target, a scene, or the average over scenes.

    Attributes:
        scene: the scene's name; empty for the average.
        target: the target's state in the scene's own numbering; None for a scene and for the average.
        target_count: how many targets this is the mean of.
        failed_targets: (scene, state) of those among them that were not reached in every episode.
        values: by name (`metrics.METRIC_NAMES`).
        intervals: 95 % bootstrap interval by name.
    """

    scene: str
    target: int | None
    target_count: int
    failed_targets: tuple[tuple[str, int], ...]
    values: Mapping[str, float]
    intervals: Mapping[str, Interval]

    @property
    def solved_targets(self) -> int:
        """How many targets were reached in every episode."""
        return self.target_count - len(self.failed_targets)

    def _figures(self) -> dict[str, object]:
        ends = {name: list(interval) for name, interval in self.intervals.items()}
        return {**self.values, "intervals": ends}

    def target_json(self) -> dict[str, object]:
        """JSON of a target."""
        return {"scene": self.scene, "target": self.target, **self._figures()}

    def scene_json(self) -> dict[str, object]:
        """JSON of a scene."""
        return {"scene": self.scene, **self.average_json()}

    def average_json(self) -> dict[str, object]:
        """JSON of the average."""
        failed = [{"scene": scene, "target": target} for scene, target in self.failed_targets]
        counts = {"target_count": self.target_count, "solved_targets": self.solved_targets}
        return {**counts, "failed_targets": failed, **self._figures()}


@dataclass(frozen=True)
class Evaluation:
    """One agent, evaluated in one way.

    Attributes:
        agent: its name in tables.
        encoder: name of the encoder whose features the agent saw.
        protocol: how the episodes were walked.
        targets: one result a target, in the world's order.
        scenes: one result a scene.
        average: the plain mean over scenes.
        trained: what it was trained with; None of what was not trained.
    """

    agent: str
    encoder: str
    protocol: Protocol
    targets: tuple[Result, ...]
    scenes: tuple[Result, ...]
    average: Result
    trained: Trained | None = None

    def to_json(self) -> dict[str, object]:
        """All of it as JSON values; target numbers are states in their scene's own numbering."""
        return {
            "agent": self.agent,
            "encoder": self.encoder,
            **({"trained": self.trained.to_json()} if self.trained else {}),
            "episodes_per_target": self.protocol.episodes_per_target,
            "step_limit": self.protocol.step_limit,
            "seed": self.protocol.seed,
            "action_selection": self.protocol.action_selection,
            "targets": [result.target_json() for result in self.targets],
            "scenes": [result.scene_json() for result in self.scenes],
            "average": self.average.average_json(),
        }


def summarise(world: World, table: EpisodeTable, agent: str, encoder: str, protocol: Protocol) -> Evaluation:
    """The evaluation that an agent's episodes come to.

    Args:
        world: where they were walked.
        table: the episodes; every target of the world occurs.
        agent: its name in tables.
        encoder: name of the encoder whose features the agent saw.
        protocol: how they were walked; its seed also seeds the bootstrap.
    """
    target_scene = world.target_scene.cpu().numpy()
    per_target = metrics.by_target(table, world.target_count)
    per_scene = metrics.by_scene(per_target, target_scene)
    drawn = bootstrap.resampled_by_target(*metrics.columns(table, metrics.METRICS), table.target, seed=protocol.seed)
    drawn_by_scene = metrics.by_scene(drawn, target_scene)

    names = world.scene_names
    labels = [(names[scene], world.scene_state(index)) for index, scene in enumerate(target_scene)]
    missed = np.bincount(table.target[~table.reached], minlength=world.target_count) > 0  # (M,)
    failed = [
        tuple(labels[index] for index in np.flatnonzero(missed & (target_scene == scene)))
        for scene in range(len(names))
    ]
    count = np.bincount(target_scene)

    targets = _results(per_target, bootstrap.intervals(drawn))
    scenes = _results(per_scene, bootstrap.intervals(drawn_by_scene))
    mean = _results(metrics.average(per_scene)[None], bootstrap.intervals(metrics.average(drawn_by_scene))[:, None])
    return Evaluation(
        agent=agent,
        encoder=encoder,
        protocol=protocol,
        targets=tuple(
            Result(scene, state, 1, ((scene, state),) if missed[index] else (), *targets[index])
            for index, (scene, state) in enumerate(labels)
        ),
        scenes=tuple(
            Result(name, None, int(count[index]), failed[index], *scenes[index]) for index, name in enumerate(names)
        ),
        average=Result("", None, world.target_count, sum(failed, ()), *mean[0]),
    )


def _results(values: np.ndarray, ends: np.ndarray) -> list[tuple[dict[str, float], dict[str, Interval]]]:
    """Values (rows, J) and interval ends (2, rows, J) as one pair of mappings by metric name for each row."""
    named = []
    for row, (lower, upper) in zip(values.tolist(), ends.transpose(1, 0, 2).tolist(), strict=True):
        pairs = zip(lower, upper, strict=True)
        named.append(
            (
                dict(zip(metrics.METRIC_NAMES, row, strict=True)),
                dict(zip(metrics.METRIC_NAMES, pairs, strict=True)),
            )
        )
    return named
