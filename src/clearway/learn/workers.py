"""Several processes of this machine train one agent: started, watched and replaced by PyTorch's elastic agent.

The parent checks the request and begins the run folder. The workers (`Peers`) train; the first of them writes. Where
one is killed or hangs, all are started again from the newest checkpoint, and rows of metrics after it are dropped:
nothing is learnt twice. Errors of our own end the training, since another try would meet them again.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import tempfile
import traceback
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import torch

from clearway.children import end_with_parent
from clearway.choices import TrackerName
from clearway.errors import ClearwayError, RunError
from clearway.learn.peers import LostPeer, Peers
from clearway.learn.run_folder import RunFolder, RunRecord, record_of
from clearway.learn.tracking import check_tracker
from clearway.learn.train import (
    SECONDS_BETWEEN_CHECKPOINTS,
    RunRequest,
    features_read_once,
    opened_copy,
    set_threads,
    told_of_other_bits,
    train_part,
)

if TYPE_CHECKING:
    import torch.distributed as dist

RESTARTS = 100  # of one training, after which it is given up
PATIENCE = timedelta(minutes=5)  # for another worker to answer, after which it counts as lost
FAILED = "failed"  # key of the store under which an error's words are told to the others
INTERRUPTED = "interrupted"
LOST = 3  # exit code


@dataclass(frozen=True)
class Task:
    """What every worker is to do; arguments as of `train`."""

    request: RunRequest
    out: Path
    parent: int
    show_progress: bool
    until_solved: bool
    track: TrackerName | None
    threads: int
    checkpoint_s: float
    copy_to: str | None


@dataclass(frozen=True)
class Place:
    """Which worker a process is.

    Attributes:
        rank, count: its number, from 0, of how many.
        local: its number on its machine, and of its GPU.
        restarts: how often all were started again before.
    """

    rank: int
    count: int
    local: int
    restarts: int


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
    """
    check_tracker(track)
    request.check_workers(workers)
    if ray is None:
        _check_gpus(request.device, workers)
    folder = RunFolder(out)
    opened_copy(copy_to, folder, resume)
    own_files = features_read_once(request) if ray is None else nullcontext(request)  # which other machines do not see
    with own_files as read, folder.held(), folder.begun(_record(read, workers), resume) as other_bits:
        told_of_other_bits(folder, request, other_bits)
        task = Task(
            replace(read, scenes=[scene.without_pictures() for scene in read.scenes]),
            out,
            os.getpid(),
            show_progress,
            until_solved,
            track,
            threads or (1 if ray else max(1, torch.get_num_threads() // workers)),
            checkpoint_s,
            copy_to,
        )
        if on_begin is not None:
            on_begin(out)
        outcomes = _launched(task, workers) if ray is None else _launched_on_ray(task, workers, ray)
        failed = [told for told in outcomes if told not in (None, INTERRUPTED)]
        if failed:
            raise RunError(str(failed[0]))
        if INTERRUPTED in outcomes:
            raise KeyboardInterrupt
    return folder


def _record(request: RunRequest, workers: int) -> RunRecord:
    """The record of a run by so many workers."""
    record = record_of(request)
    return replace(record, hardware={**record.hardware, "workers": workers})


def _check_gpus(device: str, workers: int) -> None:
    """Raises RunError where this machine has no GPU for each."""
    if torch.device(device).type == "cuda" and workers > (count := torch.cuda.device_count()):
        problem = f"{workers} workers on {count} GPU{'s' * (count != 1)}: each needs one of its own"
        raise RunError(f"{problem}. Give fewer --workers, or --device cpu")


def _launched_on_ray(task: Task, workers: int, address: str) -> list[str | None]:
    from clearway.learn.ray_workers import launched_on_ray

    return launched_on_ray(task, workers, address)


def _launched(task: Task, workers: int) -> list[str | None]:
    """What `work` gave in each process.

    Raises:
        RunError: workers were lost more than `RESTARTS` times.
        KeyboardInterrupt: the user interrupted, and the workers have saved and ended.
    """
    from torch.distributed.elastic.multiprocessing import DefaultLogsSpecs
    from torch.distributed.elastic.multiprocessing.api import SignalException
    from torch.distributed.elastic.multiprocessing.errors import ChildFailedError
    from torch.distributed.launcher.api import LaunchConfig, elastic_launch

    for name in logging.root.manager.loggerDict:  # each has a level of its own, and tells of deaths at length
        if name.startswith("torch.distributed.elastic"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    if sys.platform == "linux":
        os.environ.setdefault("GLOO_SOCKET_IFNAME", "lo")  # nothing leaves this machine
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    with tempfile.TemporaryDirectory(prefix="clearway-") as logs:
        config = LaunchConfig(
            min_nodes=1,
            max_nodes=1,
            nproc_per_node=workers,
            logs_specs=DefaultLogsSpecs(log_dir=logs),
            run_id="clearway",
            rdzv_backend="static",  # the others unpickle what lies in their store
            rdzv_endpoint=f"127.0.0.1:{_free_port()}",
            rdzv_configs={"rank": 0},
            local_addr="127.0.0.1",
            max_restarts=RESTARTS,
            monitor_interval=0.1,
            signals_to_handle="SIGTERM,SIGINT",
        )
        try:
            outcomes = elastic_launch(config, work)(task)
        except SignalException as error:
            raise KeyboardInterrupt from error
        except ChildFailedError as error:
            rank, failure = error.get_first_failure()
            reason = f"worker {rank} ended with exit code {failure.exitcode}"
            raise given_up(task, reason) from error
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
    return [outcomes[rank] for rank in sorted(outcomes)]


def _free_port() -> int:
    """A port of this machine's loopback device that nobody listens at."""
    with socket.socket() as plug:
        plug.bind(("127.0.0.1", 0))
        return int(plug.getsockname()[1])


def given_up(task: Task, reason: str) -> RunError:
    """The error of a training whose workers were lost too often, and how the last one was."""
    return RunError(f"{task.out}: workers were lost {RESTARTS + 1} times ({reason}). Look for what ends them")


def work(task: Task) -> str | None:
    """Train in a process that the elastic agent started; returns what `trained` does."""
    import torch.distributed as dist

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal's; the parent passes it on as SIGTERM
    end_with_parent(task.parent)
    environment = os.environ
    place = Place(
        int(environment["RANK"]),
        int(environment["WORLD_SIZE"]),
        int(environment["LOCAL_RANK"]),
        int(environment["TORCHELASTIC_RESTART_COUNT"]),
    )
    try:
        store = dist.TCPStore(environment["MASTER_ADDR"], int(environment["MASTER_PORT"]), is_master=False)
        return trained(task, place, store)
    except LostPeer:
        sys.exit(LOST)  # without a word: the agent starts all again


def trained(task: Task, place: Place, server: dist.Store) -> str | None:
    """Train as one of several workers, who meet at a store.

    Returns:
        None; `INTERRUPTED`; or the words of the error, a worker's own or another's, that ended the training.

    Raises:
        LostPeer: another worker ended or does not answer, so that all are to be started again.
    """
    import torch.distributed as dist

    set_threads(task.threads)
    cuda = torch.device(task.request.device).type == "cuda"
    device = f"cuda:{place.local}" if cuda else "cpu"
    if cuda:
        torch.cuda.set_device(place.local)
    if place.restarts and place.rank == 0:
        told = f"training: a worker was lost ({place.restarts} of at most {RESTARTS} times)"
        print(f"{told}; all go on from the newest checkpoint", file=sys.stderr, flush=True)
    store = dist.PrefixStore(f"clearway {place.restarts}", server)
    try:
        dist.init_process_group(
            "nccl" if cuda else "gloo", store=store, rank=place.rank, world_size=place.count, timeout=PATIENCE
        )
    except RuntimeError as error:  # of whatever backend
        raise LostPeer(str(error)) from error
    name = f"{socket.gethostname()}, process {os.getpid()}"
    try:
        train_part(
            replace(task.request, device=device),
            RunFolder(task.out),
            Peers(dist.group.WORLD, device, name),
            show_progress=task.show_progress,
            until_solved=task.until_solved,
            track=task.track,
            checkpoint_s=task.checkpoint_s,
            copy_to=task.copy_to,
        )
    except KeyboardInterrupt:
        return INTERRUPTED
    except LostPeer:
        if not store.check([FAILED]):
            raise
        return store.get(FAILED).decode()
    except Exception as error:  # whatever it is, another try would meet it again
        told = str(error) if isinstance(error, ClearwayError) else traceback.format_exc()
        store.set(FAILED, told)
        return told
    return None
