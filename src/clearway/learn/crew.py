"""Several processes of this machine do one task together: started, watched and replaced by PyTorch's elastic agent.

Where one is killed or hangs, all are started again, and go on from what the task has written. Errors of our own end it,
since another try would meet them again.
"""

from __future__ import annotations

import atexit
import logging
import os
import signal
import socket
import sys
import tempfile
import threading
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import torch

from clearway.children import all_children_end, check_program, end_with_parent
from clearway.errors import ClearwayError, RunError
from clearway.learn.peers import LostPeer, Peers
from clearway.spread.messages import Sent

if TYPE_CHECKING:
    import torch.distributed as dist

RESTARTS = 100  # of one task, after which it is given up
PATIENCE = timedelta(minutes=5)  # for another worker to answer, after which it counts as lost
READING = timedelta(hours=6)  # the same while it reads what it learns from, which may come from elsewhere
INTERFACE = "GLOO_SOCKET_IFNAME"  # variable: the network interface that gloo sends by
FAILED = "failed"  # key of the store under which an error's words are told to the others
INTERRUPTED = "interrupted"
LOST, ENDED = 3, 130  # exit codes
END_S = 120  # for workers to finish an update and save, after which they are killed


@dataclass(frozen=True)
class Task(ABC):
    """What every worker is to do.

    Attributes:
        out: the folder that it is done in.
        parent: process that started the workers, with which they end.
        threads: of torch in each.
        device: of torch; each worker has a GPU of its own.
        records: of files that were fetched, for other machines, see `remote.records`.
    """

    out: Path
    parent: int
    threads: int
    device: str
    records: Mapping[str, str]

    @abstractmethod
    def do(self, peers: Peers) -> None:
        """Do it as one of several workers, from where it stands, on `peers.device`.

        Raises:
            ClearwayError, KeyboardInterrupt: it ends.
            LostPeer: another worker ended, or does not answer.
        """

    @abstractmethod
    @contextmanager
    def watched(self) -> Iterator[Callable[[], None]]:
        """For Ray, where workers have no terminal: yields what shows how far it is, by the last row of metrics."""


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


def check_here(device: str, workers: int) -> None:
    """Raises RunError where this machine has no GPU for each, or workers cannot import the program, as they do."""
    if torch.device(device).type == "cuda" and workers > (count := torch.cuda.device_count()):
        problem = f"{workers} workers on {count} GPU{'s' * (count != 1)}: each needs one of its own"
        raise RunError(f"{problem}. Give fewer --workers, or --device cpu")
    check_program()


def launched_by(task: Task, workers: int, ray: str | None) -> list[str | None]:
    """Have so many processes do a task: `launched` on this machine, or on a Ray cluster (`ray_cluster.connected`)."""
    if ray is None:
        return launched(task, workers)
    from clearway.learn.ray_workers import launched_on_ray

    return launched_on_ray(task, workers, ray)


def launched(task: Task, workers: int) -> list[str | None]:
    """Have so many processes of this machine do a task.

    Returns:
        What `done_by` gave in each.

    Raises:
        RunError: workers were lost more than `RESTARTS` times, or this is not the main thread.
        KeyboardInterrupt: the user interrupted, and the workers have saved and ended.
    """
    from torch.distributed.elastic.multiprocessing import DefaultLogsSpecs
    from torch.distributed.elastic.multiprocessing.api import SignalException
    from torch.distributed.elastic.multiprocessing.errors import ChildFailedError
    from torch.distributed.launcher.api import LaunchConfig, elastic_launch

    if threading.current_thread() is not threading.main_thread():
        raise RunError(f"{task.out}: several workers are started by the main thread alone. Start them there, or one")
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def told(number: int, frame: object) -> None:
        """Have the agent, once it listens, tell the workers by SIGTERM: it passes on what it gets, and once."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if signal.getsignal(signal.SIGTERM) is before[signal.SIGTERM]:
            raise KeyboardInterrupt
        signal.raise_signal(signal.SIGTERM)

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
            signals_to_handle="SIGTERM",
            shutdown_timeout=END_S,
        )
        try:
            if before[signal.SIGINT] is not signal.SIG_IGN:
                signal.signal(signal.SIGINT, told)
            with all_children_end(), _on_loopback(), _without_elastic_log():
                outcomes = elastic_launch(config, work)(Sent(task))
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


@contextmanager
def _on_loopback() -> Iterator[None]:
    """Have workers that are started meanwhile send nothing out of this machine, unless the user chose otherwise."""
    if sys.platform != "linux" or INTERFACE in os.environ:
        yield
        return
    os.environ[INTERFACE] = "lo"
    try:
        yield
    finally:
        del os.environ[INTERFACE]


@contextmanager
def _without_elastic_log() -> Iterator[None]:
    """Silence the elastic agent, which tells of deaths at length."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("torch.distributed.elastic")]
    before = {name: logging.getLogger(name).level for name in names}  # each has one of its own
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


def ended_well(outcomes: Sequence[str | None]) -> None:
    """Raise what ended a task, of what `done_by` gave in each process.

    Raises:
        RunError: with the words of an error.
        KeyboardInterrupt: the user interrupted, and the workers have saved.
    """
    failed = [told for told in outcomes if told not in (None, INTERRUPTED)]
    if failed:
        raise RunError(str(failed[0]))
    if INTERRUPTED in outcomes:
        raise KeyboardInterrupt


def _free_port() -> int:
    """A port of this machine's loopback device that nobody listens at."""
    with socket.socket() as plug:
        plug.bind(("127.0.0.1", 0))
        return int(plug.getsockname()[1])


def given_up(task: Task, reason: str) -> RunError:
    """The error of a task whose workers were lost too often, and how the last one was."""
    return RunError(f"{task.out}: workers were lost {RESTARTS + 1} times ({reason}). Look for what ends them")


def work(task: Task) -> str | None:
    """Do a task in a process that the elastic agent started; returns what `done_by` does."""
    import torch.distributed as dist

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
        outcome = done_by(task, place, store)
    except LostPeer:
        _leave(LOST)  # without a word: the agent starts all again
    if outcome == INTERRUPTED:
        _leave(ENDED)  # the agent, which told it to end, takes no answer, and one that has one to give would wait
    atexit.register(_leave, 0)  # whatever comes after: the agent, which takes the outcome, asks for nothing else
    return outcome


def _leave(code: int) -> NoReturn:
    """End this process, in which all is saved and closed: to take PyTorch apart takes seconds, and can hang."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def done_by(task: Task, place: Place, server: dist.Store) -> str | None:
    """Do a task as one of several workers, who meet at a store.

    Returns:
        None; `INTERRUPTED`; or the words of the error, a worker's own or another's, that ended it.

    Raises:
        LostPeer: another worker ended or does not answer, so that all are to be started again.
    """
    import torch.distributed as dist

    torch.set_num_threads(task.threads)
    cuda = torch.device(task.device).type == "cuda"
    device = f"cuda:{place.local}" if cuda else "cpu"
    if cuda:
        torch.cuda.set_device(place.local)
    if place.restarts and place.rank == 0:
        told = f"{task.out}: a worker was lost ({place.restarts} of at most {RESTARTS} times)"
        print(f"{told}; all go on from the newest checkpoint", file=sys.stderr, flush=True)
    store = dist.PrefixStore(f"clearway {place.restarts}", server)
    try:
        dist.init_process_group(
            "nccl" if cuda else "gloo", store=store, rank=place.rank, world_size=place.count, timeout=PATIENCE
        )
        patient = None if cuda else dist.new_group(timeout=READING)  # NCCL would not tell of an error in time
    except RuntimeError as error:  # of whatever backend
        raise LostPeer(str(error)) from error
    name = f"{socket.gethostname()}, process {os.getpid()}"
    try:
        task.do(Peers(dist.group.WORLD, device, name, patient))
    except KeyboardInterrupt:
        return INTERRUPTED
    except LostPeer:
        if not store.check([FAILED]):
            raise
        return store.get(FAILED).decode()
    except Exception as error:  # whatever it is, another try would meet it again
        told = str(error) if isinstance(error, ClearwayError) else traceback.format_exc()
        store.set(FAILED, told)
        if not cuda:
            dist.destroy_process_group()  # so that others who wait for this one hear of it at once
        return told
    return None
