"""What live episodes come to: figures with intervals for each agent, and how two agents compare.

As on the grid, a scene's value is the plain mean over its targets and the average the plain mean over scenes; intervals
are stratified bootstraps over episodes. Two agents face the same starts and the same chances, so they are compared
episode by episode.

Axis letters: N episodes, J metrics, M targets, R resamples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.evaluation import bootstrap
from clearway.evaluation.episodes import EpisodeTable
from clearway.evaluation.metrics import Metric, average, by_scene, columns, quotients
from clearway.live.conditions import Perturbations
from clearway.live.episodes import STEP_S, LiveProtocol, LiveTable

Interval = tuple[float, float]
TIE_M = 0.001  # the body draws back a millimetre from what it touches


def _seconds(table: LiveTable) -> np.ndarray:
    return table.steps * STEP_S


METRICS: dict[str, Metric[LiveTable]] = {
    "success": Metric(lambda table: table.reached),
    "steps": Metric(lambda table: table.steps),
    "shortest_path_steps": Metric(lambda table: table.shortest_path_steps),
    "contacts": Metric(lambda table: table.contacts),
    "contacts_per_100_steps": Metric(lambda table: 100 * table.contacts, lambda table: table.steps),
    "contact_free": Metric(lambda table: table.contacts == 0),
    "min_clearance_m": Metric(lambda table: table.least_gap_m),
    "mean_clearance_m": Metric(lambda table: table.mean_gap_m * _seconds(table), _seconds),
    "within_10cm_s": Metric(lambda table: table.close_s),
    "within_30cm_s": Metric(lambda table: table.near_s),
    "share_within_10cm": Metric(lambda table: table.close_s, _seconds),
    "share_within_30cm": Metric(lambda table: table.near_s, _seconds),
    "rearranged": Metric(lambda table: table.changed),
}
"""docs/metrics.md explains each."""

GRID_METRICS: dict[str, Metric[EpisodeTable]] = {
    "success": Metric(lambda table: table.reached),
    "steps": Metric(lambda table: table.steps),
    "shortest_path_steps": Metric(lambda table: table.shortest_path_steps),
    "contacts": Metric(lambda table: table.collisions),
    "contacts_per_100_steps": Metric(lambda table: 100 * table.collisions, lambda table: table.steps),
    "contact_free": Metric(lambda table: table.collisions == 0),
}
"""Those of them that the grid has too: a blocked move there is a contact here."""

COMPARED = ("success", "contacts", "min_clearance_m", "mean_clearance_m", "share_within_10cm", "share_within_30cm")


@dataclass(frozen=True)
class Figures:
    """Values by name, each with its 95 % interval."""

    values: Mapping[str, float]
    intervals: Mapping[str, Interval]

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {**self.values, "intervals": {name: list(ends) for name, ends in self.intervals.items()}}


@dataclass(frozen=True)
class Comparison:
    """How the second agent differs from the first, episode by episode.

    Attributes:
        first, second: their names.
        differences: second less first, of `COMPARED`.
        larger_clearance: probability that the second keeps the larger least clearance in an episode, a tie (to a
            millimetre) counting half; with its interval under the same name.
    """

    first: str
    second: str
    differences: Figures
    larger_clearance: Figures

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {
            "first": self.first,
            "second": self.second,
            "second_less_first": self.differences.to_json(),
            **self.larger_clearance.to_json(),
        }


@dataclass(frozen=True)
class LiveResult:
    """One setting of the room.

    Attributes:
        label: of the setting.
        perturbations: what was changed.
        agents: figures by the agent's name.
        comparison: of two agents; None for one.
    """

    label: str
    perturbations: Perturbations
    agents: Mapping[str, Figures]
    comparison: Comparison | None

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {
            "setting": self.label,
            "perturbations": self.perturbations.to_json(),
            "agents": {name: figures.to_json() for name, figures in self.agents.items()},
            "comparison": None if self.comparison is None else self.comparison.to_json(),
        }


@dataclass(frozen=True)
class LiveReport:
    """All settings, beside the same agents on the grid.

    Attributes:
        results: a setting each.
        grid: figures (`GRID_METRICS`) by the agent's name, of as many episodes with the same starts and targets.
        targets: states by scene name.
        protocol: of both.
        encoder: whose features the agents see.
    """

    results: tuple[LiveResult, ...]
    grid: Mapping[str, Figures]
    targets: Mapping[str, Sequence[int]]
    protocol: LiveProtocol
    encoder: str

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {
            "encoder": self.encoder,
            "episodes_per_target": self.protocol.episodes_per_target,
            "step_limit": self.protocol.step_limit,
            "seed": self.protocol.seed,
            "action_selection": self.protocol.selection,
            "targets": {scene: list(states) for scene, states in self.targets.items()},
            "grid": {"agents": {name: figures.to_json() for name, figures in self.grid.items()}},
            "results": [result.to_json() for result in self.results],
        }


def grid_figures(table: EpisodeTable, target_scene: np.ndarray, seed: int) -> Figures:
    """What an agent's episodes on the grid come to, in the words of live evaluation.

    Args:
        table: the episodes; every target occurs.
        target_scene: (M,) scene of each target.
        seed: of the bootstrap.
    """
    return _figures(list(GRID_METRICS), *columns(table, GRID_METRICS), (table.target, target_scene), seed)


def summarise(
    label: str, perturbations: Perturbations, tables: Mapping[str, Sequence[LiveTable]], seed: int
) -> LiveResult:
    """What a setting comes to.

    Args:
        label: of the setting.
        perturbations: what was changed.
        tables: for each agent's name its episodes, a table a scene; two agents at most.
        seed: of the bootstrap.
    """
    agents = {name: _figures(list(METRICS), *_agent_columns(own), _places(own), seed) for name, own in tables.items()}
    comparison = None
    if len(tables) == 2:
        (first, first_tables), (second, second_tables) = tables.items()
        comparison = _compared(first, second, first_tables, second_tables, seed)
    return LiveResult(label, perturbations, agents, comparison)


def _agent_columns(tables: Sequence[LiveTable]) -> tuple[np.ndarray, np.ndarray]:
    """Numerators and denominators of all metrics, two (N, J) arrays."""
    numerators, denominators = zip(*(columns(table, METRICS) for table in tables), strict=True)
    return np.concatenate(numerators), np.concatenate(denominators)


def _places(tables: Sequence[LiveTable]) -> tuple[np.ndarray, np.ndarray]:
    """Target of each episode, (N,), counted over all scenes; scene of each target, (M,)."""
    counts = [int(table.target.max()) + 1 for table in tables]
    first = np.cumsum([0, *counts])
    target = np.concatenate([table.target + offset for table, offset in zip(tables, first, strict=False)])
    return target, np.repeat(np.arange(len(tables)), counts)


def _figures(
    names: Sequence[str],
    numerator: np.ndarray,
    denominator: np.ndarray,
    places: tuple[np.ndarray, np.ndarray],
    seed: int,
) -> Figures:
    """Averages over scenes of columns (N, J) by name, with their intervals."""
    target, scene_of_target = places
    value = average(by_scene(quotients(numerator, denominator, target, len(scene_of_target)), scene_of_target))
    drawn = bootstrap.resampled_by_target(numerator, denominator, target, seed=seed)
    low, high = bootstrap.intervals(average(by_scene(drawn, scene_of_target)))
    ends = zip(low.tolist(), high.tolist(), strict=True)
    return Figures(dict(zip(names, value.tolist(), strict=True)), dict(zip(names, ends, strict=True)))


def _compared(
    first: str, second: str, first_tables: Sequence[LiveTable], second_tables: Sequence[LiveTable], seed: int
) -> Comparison:
    """Paired by episode; for the metrics that are quotients, of the quotients of an episode."""
    chosen = [list(METRICS).index(name) for name in COMPARED]
    both = [_agent_columns(tables) for tables in (first_tables, second_tables)]
    values = [(numerator / denominator)[:, chosen] for numerator, denominator in both]
    places = _places(first_tables)
    difference = values[1] - values[0]
    differences = _figures(COMPARED, difference, np.ones_like(difference), places, seed)
    gap_m = difference[:, [COMPARED.index("min_clearance_m")]]
    larger = np.where(np.abs(gap_m) <= TIE_M, 0.5, (gap_m > 0).astype(np.float64))
    larger_figures = _figures(["probability_of_larger_clearance"], larger, np.ones_like(larger), places, seed)
    return Comparison(first, second, differences, larger_figures)
