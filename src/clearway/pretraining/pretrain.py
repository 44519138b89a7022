"""A pretraining from start, or checkpoint, to end: files, figures, interruption; it goes on bit for bit."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from clearway.choices import TrackerName
from clearway.errors import RunError
from clearway.learn.checkpoint import (
    Progress,
    newest_checkpoint,
    read_network,
    read_progress,
    read_training,
    write_checkpoint,
)
from clearway.learn.interruption import interruption
from clearway.learn.metrics_log import MetricsLog
from clearway.learn.peers import ALONE, Peers
from clearway.learn.tracking import check_tracker, tracker_of
from clearway.pretraining.eyes_folder import EyesFolder, record_of
from clearway.pretraining.trainer import Pretrainer, PretrainRequest
from clearway.torch_device import usable_device

ROWS = 200  # of metrics.jsonl, about
SECONDS_BETWEEN_CHECKPOINTS = 120.0


def pretrain(
    request: PretrainRequest,
    out: Path,
    *,
    resume: bool = False,
    track: TrackerName | None = None,
    done: Callable[[int], object] = lambda pictures: None,
) -> EyesFolder:
    """Train eyes until all pictures are used, and leave them in a folder.

    Args:
        request: what to train on, and how.
        out: the folder.
        resume: go on from the newest checkpoint in `out`; without one, begin.
        track: where figures are shown as they come, see `learn.tracking`.
        done: is told how many pictures are used.

    Raises:
        RunError: `out` holds a training already (and resume is off) or another one, is in use, training failed, or
            there is no such device.
        SceneError: a shard is damaged or gone.
        KeyboardInterrupt: the user interrupted; it can be resumed.
    """
    check_tracker(track)
    usable_device(request.device)
    folder = EyesFolder(out)
    with folder.held(), folder.begun(record_of(request), resume):
        checkpoint_s = SECONDS_BETWEEN_CHECKPOINTS
        pretrain_part(request, folder, ALONE, track=track, done=done, checkpoint_s=checkpoint_s)
    return folder


def pretrain_part(
    request: PretrainRequest,
    folder: EyesFolder,
    peers: Peers,
    *,
    track: TrackerName | None,
    done: Callable[[int], object],
    checkpoint_s: float,
) -> None:
    """Train as one of some workers, from the newest checkpoint of a folder that has been begun, if it has one.

    Whoever started the workers holds the folder.

    Args:
        request, folder: what to train on, where.
        peers: the workers; the first writes.
        track, done: as of `pretrain`.
        checkpoint_s: seconds between checkpoints.

    Raises:
        RunError, SceneError, KeyboardInterrupt: as of `pretrain`.
        LostPeer: another worker ended, or does not answer.
    """
    trainer, seconds = Pretrainer(request, peers), 0.0
    if peers.leads:
        folder.clear_parts()
    if any(folder.checkpoints.glob("frames-*")):
        seconds = _resumed(trainer, folder)
    elif peers.leads:
        folder.forget_metrics_after(-1)
    peers.ready()
    _run(trainer, folder, done, seconds, track, checkpoint_s)
    if peers.leads:
        folder.write_eyes(trainer.eyes, trainer.pictures)


def _resumed(trainer: Pretrainer, folder: EyesFolder) -> float:
    """Load the newest checkpoint; the seconds trained so far."""
    checkpoint = newest_checkpoint(folder.checkpoints)
    progress = read_progress(checkpoint)
    try:
        trainer.load(read_network(checkpoint), read_training(checkpoint), progress.updates)
    except (LookupError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:300]
        raise RunError(f"{checkpoint}: does not fit its training ({reason}). Remove it, or train again") from error
    if trainer.peers.leads:
        folder.forget_metrics_after(progress.frames)
    return progress.seconds


def _run(
    trainer: Pretrainer,
    folder: EyesFolder,
    done: Callable[[int], object],
    seconds: float,
    track: TrackerName | None,
    checkpoint_s: float,
) -> None:
    """Update until all pictures are used or the user interrupts; ends with a checkpoint either way."""
    peers = trainer.peers
    if len({updates for [updates] in peers.told(trainer.updates)}) > 1:
        raise RunError(f"{folder.path}: the workers find other checkpoints. Give a folder that all share as --out")
    if trainer.finished:
        return
    log = _log(trainer, folder, seconds, track) if peers.leads else None
    every = max(1, trainer.settings.updates // ROWS)
    saved_at = time.monotonic()
    with interruption(of_several=peers.count > 1) as interrupted:
        try:
            for lesson in trainer.lessons():
                begun = time.monotonic()
                figures = trainer.update(lesson)
                seconds += time.monotonic() - begun
                if not np.isfinite(figures["loss"]):
                    problem = f"the loss is {figures['loss']} after {trainer.pictures} pictures"
                    raise RunError(f"{folder.path}: {problem}. Training stopped; lower the learning rate")
                if log and (trainer.updates % every == 0 or trainer.finished):
                    counts = {"frames": trainer.pictures, "updates": trainer.updates, "seconds": round(seconds, 3)}
                    log.write({**counts, **{name: float(f"{value:.6g}") for name, value in figures.items()}})
                done(trainer.pictures)
                late = peers.leads and time.monotonic() - saved_at > checkpoint_s
                stops, saves = peers.any(interrupted.is_set(), late)
                if trainer.finished or stops:
                    break
                if saves:
                    _save(trainer, folder, seconds)
                    saved_at = time.monotonic()
            _save(trainer, folder, seconds)
        finally:
            if log:
                log.close()
    if not trainer.finished:
        raise KeyboardInterrupt


def _log(trainer: Pretrainer, folder: EyesFolder, seconds: float, track: TrackerName | None) -> MetricsLog:
    settings = {"seed": trainer.request.seed, **trainer.settings.to_json()}
    return MetricsLog(folder.metrics_path, tracker_of(track, folder.path, settings, folder.metrics(), seconds))


def _save(trainer: Pretrainer, folder: EyesFolder, seconds: float) -> None:
    """Write a checkpoint, the same at every worker, by the first."""
    if trainer.peers.leads:
        progress = Progress(trainer.pictures, trainer.updates, seconds)
        write_checkpoint(folder.checkpoints, trainer.eyes.state_dict(), trainer.tensors(), progress)
