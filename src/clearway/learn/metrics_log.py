"""Figures of a training run as JSON lines, and to TensorBoard where it is installed. Names: docs/metrics.md."""

from __future__ import annotations

import importlib.util
import json
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from torch import Tensor

from clearway.learn.statistics import COLLISIONS, EPISODES, REACHED, STEPS, EpisodeStatistics

Row = dict[str, float]
BOARD = "tensorboard"  # folder of TensorBoard's files, beside the JSON lines


class Counting(Protocol):
    """What a row needs of a trainer."""

    frames: int
    updates: int
    statistics: EpisodeStatistics


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
        before: the rows that the file holds already. TensorBoard's files beside it are written anew from them, so that
            a resumed run has every figure there once, and none that a killed process had not written out is missing.
        seconds: training time so far.
    """

    def __init__(self, path: Path, before: Sequence[Row] = (), seconds: float = 0.0) -> None:
        self.file = path.open("a")
        self.board: Any = None
        if importlib.util.find_spec("tensorboard"):
            from torch.utils.tensorboard import SummaryWriter

            folder = path.parent / BOARD
            shutil.rmtree(folder, ignore_errors=True)
            self.began = time.time() - seconds
            self.board = SummaryWriter(str(folder), purge_step=0 if before else None)  # for one that looks on
            for row in before:
                self._show(row)

    def write(self, row: Row) -> None:
        """Append one row."""
        self.file.write(json.dumps(row) + "\n")
        self.file.flush()
        if self.board:
            self._show(row)

    def _show(self, row: Row) -> None:
        """Hand the row's figures to TensorBoard, at the time when training had come so far without a pause."""
        for name, value in row.items():
            self.board.add_scalar(name, value, row["frames"], walltime=self.began + row["seconds"])

    def close(self) -> None:
        """Close the files."""
        self.file.close()
        if self.board:
            self.board.close()
