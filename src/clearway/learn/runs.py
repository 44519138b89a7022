"""What lies in run folders, in figures: runs side by side, where their settings differ, checkpoints that are old."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.errors import RunError
from clearway.learn.checkpoint import checkpoints, newest_checkpoint
from clearway.learn.run_folder import RUN_FILE, RunFolder
from clearway.learn.run_record import RunRecord

FIGURES = ("success", "steps", "collisions")  # of the latest row of metrics


@dataclass(frozen=True)
class RunSummary:
    """A run in figures.

    Attributes:
        path: its folder.
        record: what determines it.
        frames: trained so far, by its metrics; 0 before the first row.
        solved: targets solved by then.
        figures: `FIGURES` of the training episodes of the latest row; empty where none ended.
        seconds: trained so far.
    """

    path: Path
    record: RunRecord
    frames: int
    solved: int
    figures: Mapping[str, float]
    seconds: float

    @property
    def target_count(self) -> int:
        """Targets of all scenes."""
        return sum(map(len, self.record.targets.values()))

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "run": str(self.path),
            "scenes": list(self.record.targets),
            "reward": self.record.reward.name,
            "algorithm": self.record.learner.algorithm,
            "seed": self.record.seed,
            "frames": self.frames,
            "all_frames": self.record.learner.frames,
            "solved_targets": self.solved,
            "targets": self.target_count,
            **self.figures,
            "seconds": self.seconds,
        }


def find_runs(folder: Path) -> list[RunFolder]:
    """The runs in a folder, itself or below it, by path; not in a run's own folders, nor where a dot begins the name.

    Raises:
        RunError: there is no such folder.
    """
    if not folder.is_dir():
        raise RunError(f"{folder}: no such folder. Name one that holds runs")
    found = []
    for path, folders, files in os.walk(folder):  # takes no offence at folders that go meanwhile
        if RUN_FILE in files:
            found.append(Path(path))
            folders.clear()
        folders[:] = [name for name in folders if not name.startswith(".")]
    return [RunFolder(path) for path in sorted(found)]


def run_summary(folder: RunFolder) -> RunSummary:
    """A run in figures.

    Raises:
        RunError: there is no run, or it is damaged.
    """
    record, rows = folder.read_record(), folder.metrics()
    last = rows[-1] if rows else {}
    return RunSummary(
        path=folder.path,
        record=record,
        frames=int(last.get("frames", 0)),
        solved=int(last.get("solved_targets", 0)),
        figures={name: last[name] for name in FIGURES if name in last and last.get("episodes", 1)},
        seconds=float(last.get("seconds", 0.0)),
    )


def differences(records: Sequence[RunRecord]) -> dict[str, list[str]]:
    """What runs were asked for, by name, where not all of them agree: a text of each run, a dash where it has none."""
    told = [_settings(record) for record in records]
    names = dict.fromkeys(name for settings in told for name in settings)
    rows = {name: [settings.get(name, "-") for settings in told] for name in names}
    return {name: row for name, row in rows.items() if len(set(row)) > 1}


def _settings(record: RunRecord) -> dict[str, str]:
    content = record.to_json()
    return {
        "scenes": " ".join(record.targets),
        "targets": " ".join(f"{name}={','.join(map(str, states))}" for name, states in record.targets.items()),
        "reward": record.reward.name,
        **{name: str(value) for name, value in content["learner"].items()},
        "seed": str(record.seed),
        "zones": record.zone_level,
        "features": " ".join(dict.fromkeys(scene.encoder for scene in record.scenes)),
        "perturbed": "no" if record.takes is None else "yes",
    }


def old_checkpoints(folder: RunFolder) -> list[Path]:
    """Checkpoints before the newest that can be read, oldest first; none of a run without checkpoints.

    Raises:
        RunError: every checkpoint is damaged.
    """
    found = checkpoints(folder.checkpoints)
    return found[: found.index(newest_checkpoint(folder.checkpoints))] if found else []


def size_of(folder: Path) -> int:
    """Bytes of a folder's files."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
