"""Several processes train one agent, see `crew`.

The parent checks the request and begins the run folder. The workers (`Peers`) train; the first of them writes. Where
one is lost, all begin again from the newest checkpoint, and rows of metrics after it are dropped: nothing is learnt
twice.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from clearway.choices import TrackerName
from clearway.errors import RunError
from clearway.learn.crew import Task, check_here, ended_well, launched_by
from clearway.learn.peers import Peers
from clearway.learn.progress import progress_view
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import RunRecord, record_of
from clearway.learn.tracking import check_tracker
from clearway.learn.train import (
    SECONDS_BETWEEN_CHECKPOINTS,
    RunRequest,
    features_read_once,
    opened_copy,
    told_of_other_bits,
    train_part,
)
from clearway.remote.records import records_of


@dataclass(frozen=True)
class TrainTask(Task):
    """A training that has been begun; arguments as of `train`."""

    request: RunRequest
    show_progress: bool
    until_solved: bool
    track: TrackerName | None
    checkpoint_s: float
    copy_to: str | None

    def do(self, peers: Peers) -> None:
        """See `train_part`."""
        train_part(
            replace(self.request, device=str(peers.device)),
            RunFolder(self.out),
            peers,
            show_progress=self.show_progress,
            until_solved=self.until_solved,
            track=self.track,
            checkpoint_s=self.checkpoint_s,
            copy_to=self.copy_to,
        )

    @contextmanager
    def watched(self) -> Iterator[Callable[[], None]]:
        """See `Task`."""
        targets = sum(len(states) for states in self.request.targets.values())
        with progress_view(self.request.learner.frames, self.show_progress) as view:

            def look() -> None:
                with suppress(RunError):  # of rows that cannot be read now: the next look may see more
                    if self.show_progress and (rows := RunFolder(self.out).metrics()):
                        view.show(int(rows[-1]["frames"]), int(rows[-1]["solved_targets"]), targets)

            yield look


def train_by_workers(
    request: RunRequest,
    out: Path,
    workers: int,
    *,
    resume: bool = False,
    show_progress: bool = False,
    until_solved: bool = False,
    track: TrackerName | None = None,
    on_begin: Callable[[Path], None] | None = None,
    threads: int | None = None,
    checkpoint_s: float = SECONDS_BETWEEN_CHECKPOINTS,
    copy_to: str | None = None,
    ray: str | None = None,
) -> RunFolder:
    """Train by so many processes, two at least, as `train.train` does by this one; other arguments as there.

    Args:
        request: what to train. Features of scenes are best left in their files: every worker then reads those of its
            own scenes alone. With `feature_store="mapped"`, and not on Ray, they are read once, and all map them.
        out: the run folder.
        workers: how many.
        resume, show_progress, until_solved, track, on_begin: as of `train.train`.
        threads: of torch in each worker; None: the machine's, divided among them, and 1 on Ray.
        checkpoint_s: seconds between checkpoints.
        copy_to: as of `train.train`.
        ray: a Ray cluster that runs them, see `ray_cluster.connected`; None: this machine.

    Raises:
        RunError, KeyboardInterrupt: as of `train.train`; or workers were lost again and again.
        RewardError: no worker could import a term of the reward.
    """
    check_tracker(track)
    request.check(workers, ray)
    if ray is None:
        check_here(request.device, workers)
    folder = RunFolder(out)
    opened_copy(copy_to, folder, resume)
    own_files = features_read_once(request) if ray is None else nullcontext(request)  # which other machines do not see
    with own_files as read, folder.held(), folder.begun(_record(read, workers), resume) as other_bits:
        told_of_other_bits(folder, request, other_bits)
        task = TrainTask(
            out,
            os.getpid(),
            threads or (1 if ray else max(1, torch.get_num_threads() // workers)),
            read.device,
            records_of((request.paths or {}).values()) if ray else {},
            request=replace(read, scenes=[scene.without_pictures() for scene in read.scenes]),
            show_progress=show_progress,
            until_solved=until_solved,
            track=track,
            checkpoint_s=checkpoint_s,
            copy_to=copy_to,
        )
        if on_begin is not None:
            on_begin(out)
        ended_well(launched_by(task, workers, ray))
    return folder


def _record(request: RunRequest, workers: int) -> RunRecord:
    """The record of a run by so many workers."""
    record = record_of(request)
    return replace(record, hardware={**record.hardware, "workers": workers})
