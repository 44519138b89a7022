"""Jobs on this machine: each in a process of its own, so that one that dies takes nothing with it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from clearway.children import end_with_parent, signals_held
from clearway.errors import ClearwayError, RunError
from clearway.experiments.job import do
from clearway.experiments.plan import Job

ATTEMPTS = 3  # a job whose process is killed is begun so many times, each from its last checkpoint
POLL_S = 0.2
JOB_BYTES = 1_000_000_000  # a job on the four default rooms was seen to take 650 MB
REFUSED, INTERRUPTED = 2, 130  # a worker's exit codes


@dataclass
class _Running:
    job: Job
    process: BaseProcess
    complaint: Connection


def affordable_workers(wanted: int | None, threads: int) -> int:
    """Jobs to run side by side: as wanted or one a core and thread, but no more than memory holds."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    asked = wanted or max(1, cores // threads)
    free = _free_bytes()
    return asked if free is None else max(1, min(asked, free // JOB_BYTES))


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
    running: list[tuple[_Running, int]] = []
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                job, attempt = waiting.popleft()
                running.append((_started(out, job, threads), attempt))
            time.sleep(POLL_S)
            for one, attempt in [pair for pair in running if not pair[0].process.is_alive()]:
                running.remove((one, attempt))
                if not _ended_well(one, attempt):
                    waiting.appendleft((one.job, attempt + 1))
            show([one.job for one, _ in running])
    finally:
        for one, _ in running:
            one.process.terminate()  # training saves a checkpoint before it ends
        for one, _ in running:
            one.process.join()


def _started(out: Path, job: Job, threads: int) -> _Running:
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(out, job, threads, sender), name=job.run.name)
    with signals_held(signal.SIGINT):  # Ctrl+C; terminate() is heard
        process.start()
    sender.close()
    return _Running(job, process, receiver)


def _work(out: Path, job: Job, threads: int, complaint: Connection) -> None:
    """Do a job in this process; what the user did wrong goes to the parent as text."""
    end_with_parent()
    os.environ["OMP_NUM_THREADS"] = str(threads)
    try:
        do(out, job, threads)
    except ClearwayError as error:
        complaint.send(str(error))
        raise SystemExit(REFUSED) from error
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None


def _ended_well(one: _Running, attempt: int) -> bool:
    """True where the job is done, False where it has to begin again.

    Raises:
        RunError: the job failed.
    """
    code, name = one.process.exitcode, one.job.run.name
    if code == 0:
        return True
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    if code == REFUSED:
        raise RunError(one.complaint.recv())
    if code is not None and code < 0 and attempt < ATTEMPTS:
        return False
    how = f"was killed by {signal.Signals(-code).name}" if code is not None and code < 0 else f"ended with code {code}"
    raise RunError(
        f"run {name}: its process {how}, attempt {attempt}. Its output above says why; run the command again to go on, "
        "with fewer --workers where memory is short"
    )
