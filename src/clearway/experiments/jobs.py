"""Jobs side by side, in processes of this machine or on a Ray cluster: one that dies takes no other with it.

A process does one job after the other, since starting one takes some seconds, which is much of a small job. On a
cluster all nodes must see `out` under the same path: a job that begins again goes on from its checkpoint there.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from functools import partial
from pathlib import Path

from clearway.errors import RunError
from clearway.experiments.free_memory import free_bytes
from clearway.experiments.job import do, run_folder
from clearway.experiments.plan import Job
from clearway.learn.run_folder import METRICS_FILE
from clearway.spread.workers import ATTEMPTS, Work, core_count, workers_for

POLL_S = 0.2
JOB_BYTES = 1_000_000_000  # a job on the four default rooms was seen to take 650 MB


def affordable_workers(wanted: int | None, threads: int) -> int:
    """Jobs to run side by side: as wanted or one a core and thread, but no more than memory holds.

    Warns:
        UserWarning: memory holds fewer than were wanted.
    """
    asked = wanted or max(1, core_count() // threads)
    free = free_bytes()
    found = asked if free is None else max(1, min(asked, free // JOB_BYTES))
    if free is not None and wanted is not None and found < wanted:
        each = f"one may take {JOB_BYTES / 1e9:g} GB, {free / 1e9:.1f} are free"
        warnings.warn(f"{found} runs side by side instead of {wanted}: {each}", stacklevel=2)
    return found


def run_jobs(
    out: Path,
    jobs: Sequence[Job],
    *,
    workers: int | None,
    threads: int,
    show: Callable[[Sequence[Job]], None],
    ray: str | None = None,
) -> None:
    """Do all jobs, some side by side.

    Args:
        out: folder of the reproduction; on a cluster, on storage that all nodes share.
        jobs: to be done.
        workers: jobs side by side; None: as many as Ray finds room for.
        threads: processors that each job takes.
        show: called now and then with those under way.
        ray: a Ray cluster, see `ray_cluster.connected`; None: processes of this machine.

    Raises:
        ClearwayError: a job failed, or its process was killed again and again. The others are stopped; all can resume.
            Or Ray is not installed, or the cluster cannot be reached or has no node that is large enough.
        KeyboardInterrupt: the user interrupted; likewise.
    """
    if not jobs:
        return
    set_up = partial(_prepared, out if ray is None else out.resolve(), threads)
    work = Work(set_up, _do, _died, attempts=ATTEMPTS, cores=threads, memory_bytes=JOB_BYTES)
    before = {job.run.name: _last_sign(out, job) for job in jobs}
    with workers_for(work, workers=workers, ray=ray) as crew:
        tasks = {crew.submit(job): job for job in jobs}
        waiting = set(tasks)
        while waiting:
            done, waiting = wait(waiting, timeout=POLL_S, return_when=FIRST_COMPLETED)
            for task in done:
                task.result()
            left = [(task, job) for task, job in tasks.items() if task in waiting]
            # Ray does not say what is under way, but the files do
            show([job for task, job in left if task.running() or _last_sign(out, job) != before[job.run.name]])


def _prepared(out: Path, threads: int) -> tuple[Path, int]:
    """What a worker needs for every job: the folder and its threads."""
    os.environ["OMP_NUM_THREADS"] = str(threads)
    return out, threads


def _do(prepared: tuple[Path, int], job: Job) -> None:
    out, threads = prepared
    do(out, job, threads)


def _died(job: Job, how: str) -> RunError:
    return RunError(
        f"run {job.run.name}: its process {how}. Its output above says why; run the command again to go on, with fewer "
        "--workers where memory is short"
    )


def _last_sign(out: Path, job: Job) -> int | None:
    """When the job last wrote to its metrics, nanoseconds; None where it has not yet."""
    path = run_folder(out, job.run).path / METRICS_FILE
    return path.stat().st_mtime_ns if path.exists() else None
