"""The metrics, each written down once: for a target a quotient of two sums over its episodes.

A scene's value is the plain mean over its targets, the average the plain mean over scenes, as in the paper.
Failed episodes count with the capped steps; nothing is left out. `docs/metrics.md` explains every name.

Axis letters: N episodes, J metrics, M targets, C scenes, R resamples.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from clearway.evaluation.episodes import EpisodeTable
from clearway.zones import Zone

SC_STEPS = 500
SC_DETOUR = 4


class Episodes(Protocol):
    """A table of N episodes, on the grid or off it."""

    def __len__(self) -> int:
        """N."""


Table = TypeVar("Table", bound=Episodes)
Column = Callable[[Table], np.ndarray]


def steps(table: EpisodeTable) -> np.ndarray:
    """Steps of each episode, (N,)."""
    return table.steps


def collisions(table: EpisodeTable) -> np.ndarray:
    """Blocked moves of each episode, (N,)."""
    return table.collisions


def shortest_path_steps(table: EpisodeTable) -> np.ndarray:
    """Fewest steps possible in each episode, (N,)."""
    return table.shortest_path_steps


def success(table: EpisodeTable) -> np.ndarray:
    """1 where the target was reached within the limit, (N,)."""
    return table.reached.astype(np.float64)


def sc(table: EpisodeTable) -> np.ndarray:
    """1 where the target was reached in under 500 steps (the paper's success score), (N,)."""
    return (table.reached & (table.steps < SC_STEPS)).astype(np.float64)


def sc_4x(table: EpisodeTable) -> np.ndarray:
    """1 where the target was reached in at most 4 times the shortest path's steps, (N,)."""
    return (table.reached & (table.steps <= SC_DETOUR * table.shortest_path_steps)).astype(np.float64)


def spl(table: EpisodeTable) -> np.ndarray:
    """Success weighted by path length, S l / max(p, l) (Anderson et al. 2018, arXiv:1807.06757), (N,)."""
    return success(table) * table.shortest_path_steps / np.maximum(table.steps, table.shortest_path_steps)


def collision_free(table: EpisodeTable) -> np.ndarray:
    """1 where no move was blocked, whether or not the target was reached, (N,)."""
    return (table.collisions == 0).astype(np.float64)


def collision_free_spl(table: EpisodeTable) -> np.ndarray:
    """SPL, 0 where any move was blocked, (N,)."""
    return spl(table) * collision_free(table)


def looped(table: EpisodeTable) -> np.ndarray:
    """1 where the agent was caught in a circle for ever, (N,)."""
    return table.looped.astype(np.float64)


def _steps_in(zone: Zone) -> Column[EpisodeTable]:
    return lambda table: table.zone_steps[:, zone]


def _hundred_collisions(table: EpisodeTable) -> np.ndarray:
    return 100.0 * table.collisions


def _one(table: Episodes) -> np.ndarray:
    return np.ones(len(table))


@dataclass(frozen=True)
class Metric(Generic[Table]):
    """A target's value is sum(numerator) / sum(denominator) over its episodes; over 1 each it is a mean."""

    numerator: Column[Table]
    denominator: Column[Table] = _one


METRICS: dict[str, Metric[EpisodeTable]] = {
    "steps": Metric(steps),
    "shortest_path_steps": Metric(shortest_path_steps),
    "path_ratio": Metric(steps, shortest_path_steps),
    "collisions": Metric(collisions),
    "collisions_per_100_steps": Metric(_hundred_collisions, steps),
    "collision_free": Metric(collision_free),
    "success": Metric(success),
    "sc": Metric(sc),
    "sc_4x": Metric(sc_4x),
    "spl": Metric(spl),
    "collision_free_spl": Metric(collision_free_spl),
    "collision_visits": Metric(_steps_in(Zone.COLLISION)),
    "precollision_visits": Metric(_steps_in(Zone.PRECOLLISION)),
    "share_free": Metric(_steps_in(Zone.FREE), steps),
    "share_precollision": Metric(_steps_in(Zone.PRECOLLISION), steps),
    "share_collision": Metric(_steps_in(Zone.COLLISION), steps),
    "looped": Metric(looped),
}
METRIC_NAMES = tuple(METRICS)


def columns(table: Table, metrics: Mapping[str, Metric[Table]]) -> tuple[np.ndarray, np.ndarray]:
    """Numerators and denominators of the metrics, two (N, J) float64 arrays."""
    numerator = np.stack([metric.numerator(table) for metric in metrics.values()], axis=1)
    denominator = np.stack([metric.denominator(table) for metric in metrics.values()], axis=1)
    return numerator.astype(np.float64), denominator.astype(np.float64)


def by_target(table: EpisodeTable, target_count: int) -> np.ndarray:
    """Value of every metric of METRICS for each target, (M, J) float64."""
    return quotients(*columns(table, METRICS), table.target, target_count)


def quotients(numerator: np.ndarray, denominator: np.ndarray, target: np.ndarray, target_count: int) -> np.ndarray:
    """Sums of the numerators (N, J) by those of the denominators (N, J) over the episodes of each target, (M, J)."""
    return _sums(numerator, target, target_count) / _sums(denominator, target, target_count)


def by_scene(target_values: np.ndarray, target_scene: np.ndarray) -> np.ndarray:
    """Plain means over each scene's targets: (..., M, J) -> (..., C, J); target_scene: (M,) int."""
    scenes = range(int(target_scene.max()) + 1)
    return np.stack([target_values[..., target_scene == scene, :].mean(axis=-2) for scene in scenes], axis=-2)


def average(scene_values: np.ndarray) -> np.ndarray:
    """Plain means over scenes: (..., C, J) -> (..., J)."""
    return scene_values.mean(axis=-2)


def _sums(values: np.ndarray, target: np.ndarray, target_count: int) -> np.ndarray:
    total = np.zeros((target_count, values.shape[1]))
    np.add.at(total, target, values)
    return total
