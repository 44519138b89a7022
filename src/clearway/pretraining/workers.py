"""Several processes train one pair of eyes: each learns from its part of every batch, see `together`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from clearway.choices import TrackerName
from clearway.errors import RunError
from clearway.learn.crew import Task, check_here, ended_well, launched_by
from clearway.learn.peers import Peers
from clearway.learn.tracking import check_tracker
from clearway.pretraining.eyes_folder import EyesFolder, record_of
from clearway.pretraining.pretrain import SECONDS_BETWEEN_CHECKPOINTS, pretrain_part
from clearway.pretraining.together import check_groups
from clearway.pretraining.trainer import PretrainRequest
from clearway.progress import work_progress
from clearway.remote.records import records_of
from clearway.torch_device import usable_device


@dataclass(frozen=True)
class PretrainTask(Task):
    """A pretraining that has been begun; arguments as of `pretrain_by_workers`."""

    request: PretrainRequest
    track: TrackerName | None
    show_progress: bool
    checkpoint_s: float

    def do(self, peers: Peers) -> None:
        """See `pretrain_part`."""
        request = replace(self.request, device=str(peers.device))
        shown = self.show_progress and peers.leads
        with work_progress("learning to see", request.settings.pictures, shown) as done:
            folder = EyesFolder(self.out)
            pretrain_part(request, folder, peers, track=self.track, done=done, checkpoint_s=self.checkpoint_s)

    @contextmanager
    def watched(self) -> Iterator[Callable[[], None]]:
        """See `Task`."""
        with work_progress("learning to see", self.request.settings.pictures, self.show_progress) as done:

            def look() -> None:
                with suppress(RunError):  # of rows that cannot be read now: the next look may see more
                    if self.show_progress and (rows := EyesFolder(self.out).metrics()):
                        done(int(rows[-1]["frames"]))

            yield look


def pretrain_by_workers(
    request: PretrainRequest,
    out: Path,
    workers: int,
    *,
    resume: bool = False,
    track: TrackerName | None = None,
    show_progress: bool = False,
    threads: int | None = None,
    checkpoint_s: float = SECONDS_BETWEEN_CHECKPOINTS,
    ray: str | None = None,
) -> EyesFolder:
    """Train eyes by so many processes, two at least, as `pretrain.pretrain` does by this one.

    Args:
        request, out, resume, track: as of `pretrain.pretrain`.
        workers: how many.
        show_progress: draw a progress bar.
        threads: of torch in each worker; None: the machine's, divided among them, and 1 on Ray.
        checkpoint_s: seconds between checkpoints.
        ray: a Ray cluster that runs them, see `ray_cluster.connected`; None: this machine.

    Raises:
        ArgumentError: a batch has too few pictures for so many.
        RunError, KeyboardInterrupt: as of `pretrain.pretrain`; or workers were lost again and again.
    """
    check_tracker(track)
    usable_device(request.device)
    check_groups(request.settings, workers)
    if ray is None:
        check_here(request.device, workers)
    folder, record = EyesFolder(out), record_of(request)
    record["hardware"]["workers"] = workers
    with folder.held(), folder.begun(record, resume):
        task = PretrainTask(
            out,
            os.getpid(),
            threads or (1 if ray else max(1, torch.get_num_threads() // workers)),
            request.device,
            records_of(shard.path for shard in request.views.shards) if ray else {},
            request=request,
            track=track,
            show_progress=show_progress,
            checkpoint_s=checkpoint_s,
        )
        ended_well(launched_by(task, workers, ray))
    return folder
