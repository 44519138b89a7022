"""Jobs on this machine, in processes of their own: one that dies takes no other job with it.

A process does one job after the other, since starting one takes some seconds, which is much of a small job.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
import warnings
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from clearway.children import end_with_parent, signals_held
from clearway.errors import ClearwayError, RunError
from clearway.experiments.job import do
from clearway.experiments.plan import Job

ATTEMPTS = 3  # a job whose process is killed is begun so many times, each from its last checkpoint
POLL_S = 0.2
JOB_BYTES = 1_000_000_000  # a job on the four default rooms was seen to take 650 MB
INTERRUPTED = 130  # a worker's exit code


class _Worker:
    """A process that does one job after the other, and what connects this one with it."""

    def __init__(self, out: Path, threads: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(out, threads, theirs))
        with signals_held(signal.SIGINT):  # Ctrl+C; terminate() is heard
            self.process.start()
        theirs.close()
        self.job: Job | None = None
        self.attempt = 0

    def begin(self, job: Job, attempt: int) -> None:
        """Let it do a job, for the attempt-th time."""
        self.job, self.attempt = job, attempt
        with suppress(ConnectionError):  # it is dead, which `has_ended` finds out
            self.connection.send(job)

    def has_ended(self) -> bool | None:
        """True where its job is done, False where it has to begin again, in another process; None: it is at work.

        Raises:
            RunError: the job failed.
            KeyboardInterrupt: the user interrupted.
        """
        alive = self.process.is_alive()  # asked first: what it said before it died is there by then
        with suppress(EOFError, ConnectionError):
            if self.connection.poll():
                complaint = self.connection.recv()
                if complaint is None:
                    return True
                raise RunError(complaint)
        return None if alive else self._begins_again()

    def _begins_again(self) -> bool:
        assert self.job is not None
        self.process.join()
        code, name = self.process.exitcode, self.job.run.name
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        if code is not None and code < 0 and self.attempt < ATTEMPTS:
            return False
        how = f"ended with code {code}" if code is None or code >= 0 else f"was killed by {signal.Signals(-code).name}"
        raise RunError(
            f"run {name}: its process {how}, attempt {self.attempt}. Its output above says why; run the command again "
            "to go on, with fewer --workers where memory is short"
        )


def affordable_workers(wanted: int | None, threads: int) -> int:
    """Jobs to run side by side: as wanted or one a core and thread, but no more than memory holds.

    Warns:
        UserWarning: memory holds fewer than were wanted.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    asked = wanted or max(1, cores // threads)
    free = _free_bytes()
    found = asked if free is None else max(1, min(asked, free // JOB_BYTES))
    if free is not None and wanted is not None and found < wanted:
        each = f"one may take {JOB_BYTES / 1e9:g} GB, {free / 1e9:.1f} are free"
        warnings.warn(f"{found} runs side by side instead of {wanted}: {each}", stacklevel=2)
    return found


def _free_bytes() -> int | None:
    """Memory that new processes can have; None where the system does not say."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")), None)


def run_jobs(
    out: Path, jobs: Sequence[Job], *, workers: int, threads: int, show: Callable[[Sequence[Job]], None]
) -> None:
    """Do all jobs, some side by side; `show` is called now and then with those under way.

    Raises:
        ClearwayError: a job failed, or its process was killed again and again. The others are stopped; all can resume.
        KeyboardInterrupt: the user interrupted; likewise.
    """
    waiting = deque((job, 1) for job in jobs)
    at_work: list[_Worker] = []
    idle: list[_Worker] = []
    try:
        while waiting or at_work:
            while waiting and len(at_work) < workers:
                worker = idle.pop() if idle else _Worker(out, threads)
                worker.begin(*waiting.popleft())
                at_work.append(worker)
            time.sleep(POLL_S)
            for worker in list(at_work):
                done = worker.has_ended()
                if done is None:
                    continue
                at_work.remove(worker)
                if done:
                    idle.append(worker)
                elif worker.job is not None:
                    waiting.appendleft((worker.job, worker.attempt + 1))
            show([worker.job for worker in at_work if worker.job is not None])
    finally:
        for worker in at_work + idle:
            worker.process.terminate()  # training saves a checkpoint before it ends
        for worker in at_work + idle:
            worker.process.join()


def _work(out: Path, threads: int, connection: Connection) -> None:
    """Do in this process what the parent asks for, and say None when it is done, or what the user did wrong."""
    end_with_parent()
    os.environ["OMP_NUM_THREADS"] = str(threads)
    try:
        while True:
            job = connection.recv()
            do(out, job, threads)
            connection.send(None)
    except ClearwayError as error:
        connection.send(str(error))
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
