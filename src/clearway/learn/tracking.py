"""Figures of a training shown elsewhere as they come: `--track tensorboard` or `wandb`. metrics.jsonl is there anyway.

Both packages are extras. Weights & Biases keeps everything in the run folder (`wandb sync` hands it over) unless its
user has logged in, or WANDB_MODE says otherwise.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import time
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, get_args

from clearway.choices import TrackerName
from clearway.errors import RunError, install_hint
from clearway.regular_files import read_text

BOARD, WANDB = "tensorboard", "wandb"  # folders of their files, beside the JSON lines
ID_FILE = "clearway-run-id"
MAX_ID_BYTES = 100


class Tracker(Protocol):
    """Shows rows of figures."""

    def show(self, row: Mapping[str, float]) -> None:
        """Show a row; its frames say where on the axis, its seconds when."""

    def close(self) -> None:
        """Nothing more comes."""


def check_tracker(name: str | None) -> None:
    """Check that a tracker can be had; None is none.

    Raises:
        RunError: it is unknown, or its package is not installed.
    """
    if name is None:
        return
    if name not in get_args(TrackerName):
        raise RunError(f"--track {name!s:.40}: expected {' or '.join(get_args(TrackerName))}. Give one of them")
    if importlib.util.find_spec(name) is None:
        raise RunError(f"--track {name}: needs {name}. {install_hint(name)}")


def tracker_of(
    name: TrackerName | None,
    folder: Path,
    settings: Mapping[str, Any],
    before: Sequence[Mapping[str, float]] = (),
    seconds: float = 0.0,
) -> Tracker | None:
    """The tracker of a run that begins or goes on; None for none.

    Args:
        name: which.
        folder: of the run, for its files.
        settings: of the run, JSON values.
        before: rows that were there already.
        seconds: training time so far.

    Raises:
        RunError: as of `check_tracker`; or it cannot be used.
    """
    check_tracker(name)
    if name == BOARD:
        return _Board(folder / BOARD, before, seconds)
    return _Wandb(folder, settings, before) if name == WANDB else None


class _Board:
    """TensorBoard. Its files are written anew from the rows that are there.

    So a resumed run has every figure there once, and none that a killed process had not written out is missing.
    """

    def __init__(self, folder: Path, before: Sequence[Mapping[str, float]], seconds: float) -> None:
        from torch.utils.tensorboard import SummaryWriter

        shutil.rmtree(folder, ignore_errors=True)
        self.began = time.time() - seconds
        self.writer: Any = SummaryWriter(str(folder), purge_step=0 if before else None)  # for one that looks on
        for row in before:
            self.show(row)

    def show(self, row: Mapping[str, float]) -> None:
        """Hand the figures over, at the time when training had come so far without a pause."""
        for name, value in row.items():
            self.writer.add_scalar(name, value, row["frames"], walltime=self.began + row["seconds"])

    def close(self) -> None:
        """Close its files."""
        self.writer.close()


class _Wandb:
    """Weights & Biases: one run there for a run folder, however often it is resumed."""

    def __init__(self, folder: Path, settings: Mapping[str, Any], before: Sequence[Mapping[str, float]]) -> None:
        import wandb

        known = folder / WANDB / ID_FILE
        new = not known.exists()
        known.parent.mkdir(parents=True, exist_ok=True)
        if new:
            known.write_text(uuid.uuid4().hex)
        try:
            mode = os.environ.get("WANDB_MODE") or _mode(wandb)
            self.run: Any = wandb.init(
                project=os.environ.get("WANDB_PROJECT", "clearway"),
                name=folder.resolve().name,
                id=read_text(known, MAX_ID_BYTES).strip(),
                dir=str(folder),
                mode=mode,
                resume="allow" if mode == "online" else None,
                config=dict(settings),
                settings=wandb.Settings(console="off", silent=True, disable_git=True, disable_code=True),
            )
        except wandb.Error as fault:
            reason = " ".join(str(fault).split())[:200]
            raise RunError(f"--track wandb: {reason}. Log in (wandb login), or set WANDB_MODE=offline") from fault
        for row in before if new else ():
            self.show(row)

    def show(self, row: Mapping[str, float]) -> None:
        """Hand the figures over, at the frame they are of."""
        self.run.log(dict(row), step=int(row["frames"]))

    def close(self) -> None:
        """Wait until all is written."""
        self.run.finish()


def _mode(wandb: Any) -> str:
    """Online for one who has logged in."""
    return "online" if wandb.login(prompt=False, verify=False) else "offline"
