"""Figures of a training run as JSON lines, and to a tracker where one is asked for. Names: docs/metrics.md."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from torch import Tensor

from clearway.learn.statistics import COLLISIONS, EPISODES, REACHED, STEPS, EpisodeStatistics
from clearway.learn.tracking import Tracker

Row = dict[str, float]
OWN_FIGURES = (
    *("frames", "updates", "seconds", "episodes", "success", "steps", "collisions", "solved_targets"),
    *("slowest_worker", "slowest_factor"),
)
"""Names of figures that rows have of every algorithm, and that none of an algorithm's own can have."""


class Counting(Protocol):
    """What a row needs of a trainer."""

    @property
    def frames(self) -> int:
        """Used so far."""

    @property
    def updates(self) -> int:
        """Made so far."""

    @property
    def statistics(self) -> EpisodeStatistics:
        """Of its episodes."""


def metrics_row(trainer: Counting, figures: Mapping[str, float], seconds: float) -> Row:
    """One row of figures: the episodes ended since the last row, and the latest update's own.

    seconds: training time so far, checkpoints and evaluation left out.
    """
    totals = trainer.statistics.take()
    return {
        "frames": trainer.frames,
        "updates": trainer.updates,
        "seconds": round(seconds, 3),
        **episode_figures(totals),
        "solved_targets": trainer.statistics.solved,
        **{name: _short(value) for name, value in figures.items()},
    }


def episode_figures(totals: Tensor) -> Row:
    """Means over ended episodes from totals (M, 4); 0 where none ended."""
    sums = totals.sum(0).tolist()
    episodes = max(sums[EPISODES], 1.0)
    return {
        "episodes": int(sums[EPISODES]),
        "success": _short(sums[REACHED] / episodes),
        "steps": _short(sums[STEPS] / episodes),
        "collisions": _short(sums[COLLISIONS] / episodes),
    }


def _short(value: float) -> float:
    return float(f"{value:.6g}")


class MetricsLog:
    """Appends rows to a file; every row reaches the file at once.

    Args:
        path: of the JSON lines.
        tracker: is shown every row too.
    """

    def __init__(self, path: Path, tracker: Tracker | None = None) -> None:
        self.file, self.tracker = path.open("a"), tracker

    def write(self, row: Row) -> None:
        """Append one row."""
        self.file.write(json.dumps(row) + "\n")
        self.file.flush()
        if self.tracker:
            self.tracker.show(row)

    def close(self) -> None:
        """Close the file, and the tracker's."""
        self.file.close()
        if self.tracker:
            self.tracker.close()
