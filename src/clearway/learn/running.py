"""A training under way: updates, rows of metrics, milestones, checkpoints and their copies, until it ends."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from torch import Tensor

from clearway.choices import TrackerName
from clearway.errors import RunError
from clearway.learn.checkpoint import Progress, write_checkpoint
from clearway.learn.figures import Figures
from clearway.learn.learner import Learner
from clearway.learn.metrics_log import MetricsLog, metrics_row
from clearway.learn.pace import Pace
from clearway.learn.peers import Peers
from clearway.learn.plugged import faults_of
from clearway.learn.progress import ProgressView
from clearway.learn.run_copy import CopyingMeanwhile, RunCopy
from clearway.learn.run_folder import RunFolder
from clearway.learn.statistics import EpisodeStatistics
from clearway.learn.tracking import tracker_of
from clearway.world.world import World

ROWS_A_RUN = 200  # rows of metrics.jsonl, about


class Learning(Protocol):
    """What a run needs of a trainer, whatever the algorithm."""

    @property
    def world(self) -> World:
        """It learns in."""

    @property
    def statistics(self) -> EpisodeStatistics:
        """Of its episodes."""

    @property
    def frames(self) -> int:
        """Used so far."""

    @property
    def updates(self) -> int:
        """Made so far."""

    @property
    def learner(self) -> Learner:
        """The settings."""

    @property
    def finished(self) -> bool:
        """All frames of the settings are used."""

    def update(self) -> Figures:
        """Learn from some more frames; returns the algorithm's figures, see docs/metrics.md."""

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on, besides `frames` and `updates`."""

    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """Go on from where `tensors` was called, after that many frames and updates."""

    def fixed_tensors(self) -> dict[str, Tensor]:
        """What an agent needs to act, besides `Learner.acts_on` of `tensors`, and training does not change."""

    def close(self) -> None:
        """Give back what lives outside this process's own memory, such as other processes."""


@dataclass
class Running:
    """A training under way, of this worker: updates, rows of metrics, milestones, checkpoints.

    With several workers all of them come by the same lines, and the first writes.

    Attributes:
        trainer, folder, view, interrupted, milestones, until_solved, track: as of `train`.
        peers: the workers.
        checkpoint_s: seconds between checkpoints.
        copy: where checkpoints are copied to; None: nowhere.
    """

    trainer: Learning
    folder: RunFolder
    view: ProgressView
    interrupted: threading.Event
    milestones: Sequence[int]
    until_solved: bool
    track: TrackerName | None
    peers: Peers
    checkpoint_s: float
    copy: RunCopy | None = None

    def go_on(self, seconds: float) -> None:
        """Update until the frames are used or the user interrupts; ends with a checkpoint either way.

        A run that is finished already is left as it is. `seconds`: trained so far.
        """
        if self._done():
            self._copy()  # which may have failed before
            return
        log = self._log(seconds)
        meanwhile = None if self.copy is None else CopyingMeanwhile(self.copy)
        try:
            self._train(log, seconds, meanwhile)
        finally:
            if log:
                log.close()
            if meanwhile is not None:
                meanwhile.wait()
        self._copy()
        if not self._done():
            raise KeyboardInterrupt

    def _copy(self) -> None:
        """Bring the copy up to date, where there is to be one. Raises ClearwayError."""
        if self.copy is not None:
            self.copy.update(self.folder.path)

    def _done(self) -> bool:
        return self.trainer.finished or (self.until_solved and self.trainer.statistics.all_solved)

    def _save(self, seconds: float) -> None:
        """Write a checkpoint; other workers give their part of it."""
        if self.peers.leads:
            save(self.trainer, self.folder, seconds)
        else:
            self.trainer.tensors()

    def _log(self, seconds: float) -> MetricsLog | None:
        """Where rows are written; None at workers that do not."""
        if not self.peers.leads:
            return None
        folder = self.folder
        settings = folder.read_record().to_json() if self.track else {}
        tracker = tracker_of(self.track, folder.path, settings, folder.metrics(), seconds)
        return MetricsLog(folder.metrics_path, tracker)

    def _train(self, log: MetricsLog | None, seconds: float, meanwhile: CopyingMeanwhile | None) -> None:
        trainer, pace = self.trainer, Pace(self.peers)
        seen, rows = trainer.frames, _rows_due(trainer)
        saved_at, saved_frames = time.monotonic(), trainer.frames or None  # a resumed trainer stands at its checkpoint
        update: Figures | None = None

        def tell() -> None:
            """Keep the milestones gone by, and write the row that is due."""
            nonlocal seen, rows
            for milestone in self.milestones:
                if seen < milestone <= trainer.frames:
                    _save_agent(trainer, self.folder.milestone(milestone), seconds)
            stopped = seen < trainer.frames and not trainer.finished and self._done()  # its last row is due, no frame
            if update is not None and (_rows_due(trainer) > rows or stopped):
                row = metrics_row(trainer, update, seconds) | pace.figures()
                if log:
                    log.write(row)
                rows = _rows_due(trainer)
            seen = trainer.frames

        [stops] = self.peers.any(self.interrupted.is_set())
        while not self._done() and not stops:
            started = time.monotonic()
            with pace.measured():
                update = trainer.update()
            seconds += time.monotonic() - started
            late = time.monotonic() - saved_at > self.checkpoint_s
            stops, saves = self.peers.any(self.interrupted.is_set(), late and self.peers.leads)
            if saves or trainer.finished or any(seen < milestone <= trainer.frames for milestone in self.milestones):
                trainer.tensors()  # A3C's workers walk on until then; what is told and what is saved must agree
            tell()
            self.view.show(trainer.frames, trainer.statistics.solved, trainer.statistics.target_count)
            if saves:
                self._save(seconds)  # gathers anew: a row that was told has begun the counts of episodes again
                if meanwhile is not None:
                    meanwhile.begin(self.folder.path)
                saved_at, saved_frames = time.monotonic(), trainer.frames
        trainer.tensors()
        tell()
        if saved_frames != trainer.frames:
            self._save(seconds)


def _rows_due(trainer: Learning) -> int:
    """Rows of metrics that training has come by; the last is due with the last frame."""
    return trainer.frames * ROWS_A_RUN // trainer.learner.frames


def save(trainer: Learning, folder: RunFolder, seconds: float) -> None:
    """Write a checkpoint of the trainer as it stands."""
    tensors = trainer.tensors()
    training = {key: value for key, value in tensors.items() if not _acts(trainer, key)}
    _write(trainer, folder.checkpoints, tensors, training, seconds)


def _save_agent(trainer: Learning, folder: Path, seconds: float) -> None:
    """Write what is needed to act, not to train on, in place of what a run that went on otherwise may have left."""
    tensors = trainer.tensors()
    if folder.exists():
        shutil.rmtree(folder)
    _write(trainer, folder, tensors, {}, seconds)


def _write(
    trainer: Learning, folder: Path, tensors: Mapping[str, Tensor], training: Mapping[str, Tensor], seconds: float
) -> None:
    """Write a checkpoint of what acts among the trainer's tensors, and of what it needs to train on."""
    progress = Progress(trainer.frames, trainer.updates, seconds)
    with faults_of(trainer.learner, "keeping its tensors", (OSError,)):
        write_checkpoint(folder, acting_tensors(trainer, tensors), training, progress)


def acting_tensors(trainer: Learning, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """What is needed to act: of a network the parameters, and the map that prepares features.

    Raises:
        RunError: a parameter is not finite.
    """
    learnt = {key: value for key, value in tensors.items() if _acts(trainer, key)}
    broken = [name for name, tensor in learnt.items() if not tensor.isfinite().all()]
    if broken:
        raise RunError(
            f"{broken[0]} holds NaN or Inf after {trainer.frames} frames. Training stopped; "
            "lower the learning rate or check the features"
        )
    return learnt | trainer.fixed_tensors()


def _acts(trainer: Learning, name: str) -> bool:
    """Whether an agent needs the trainer's tensor of that name to act."""
    return name.startswith(f"{trainer.learner.acts_on}.")
