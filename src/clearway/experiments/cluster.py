"""Jobs on a Ray cluster: the same jobs, wherever there is room; a worker or a node that dies costs minutes.

All nodes must see `out` under the same path, since a job that begins again goes on from its checkpoint there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from clearway.errors import RunError
from clearway.experiments.job import do, run_folder
from clearway.experiments.local import ATTEMPTS, JOB_BYTES, POLL_S
from clearway.experiments.plan import Job
from clearway.learn.run_folder import METRICS_FILE
from clearway.ray_cluster import connected, result

GRACE_S = 60.0  # for jobs under way to save a checkpoint when the user interrupts


def run_jobs_on_ray(
    out: Path,
    jobs: Sequence[Job],
    *,
    address: str,
    workers: int | None,
    threads: int,
    show: Callable[[Sequence[Job]], None],
) -> None:
    """Do all jobs on a cluster.

    Args:
        out: folder of the reproduction, on storage that all nodes share.
        jobs: to be done.
        address: "local" starts Ray on this machine, "auto" finds a running cluster, or a cluster's address.
        workers: jobs side by side under "local"; None: as many as Ray finds room for.
        threads: processors that each job takes.
        show: called now and then with those under way.

    Raises:
        ClearwayError: Ray is not installed, the cluster cannot be reached or has no node that is large enough, or a job
            failed.
    """
    if not jobs:
        return
    with connected(address, None if workers is None else workers * threads) as ray:
        _check_room(ray, threads)
        # a fresh process a job, as on one machine; a job whose worker or node dies is begun again by Ray
        options = {"num_cpus": threads, "max_calls": 1, "max_retries": ATTEMPTS - 1, "memory": JOB_BYTES}
        remote = ray.remote(**options)(do)
        before = {job.run.name: _last_sign(out, job) for job in jobs}
        waiting = {remote.options(name=job.run.name).remote(out.resolve(), job, threads): job for job in jobs}
        try:
            while waiting:
                done, _ = ray.wait(list(waiting), timeout=POLL_S)
                for reference in done:
                    job = waiting.pop(reference)
                    result(ray, reference, partial(_death, job))
                show([job for job in waiting.values() if _last_sign(out, job) != before[job.run.name]])
        finally:
            for reference in waiting:
                ray.cancel(reference, force=False)  # training saves a checkpoint before it ends
            if waiting:
                ray.wait(list(waiting), num_returns=len(waiting), timeout=GRACE_S)


def _check_room(ray: Any, threads: int) -> None:
    """Refuse what Ray would wait for without a word.

    Raises:
        RunError: no node has the processors and the memory for a job.
    """
    nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
    if not any(node.get("CPU", 0) >= threads and node.get("memory", 0) >= JOB_BYTES for node in nodes):
        found = "; ".join(f"{node.get('CPU', 0):g} and {node.get('memory', 0) / 1e9:.1f} GB" for node in nodes)
        raise RunError(
            f"no node of the Ray cluster has the {threads} processors and {JOB_BYTES / 1e9:g} GB of memory that a run "
            f"takes (there are {found}). Give fewer --threads, or add a larger node"
        )


def _last_sign(out: Path, job: Job) -> int | None:
    """When the job last wrote to its metrics, nanoseconds; None where it has not yet."""
    path = run_folder(out, job.run).path / METRICS_FILE
    return path.stat().st_mtime_ns if path.exists() else None


def _death(job: Job, reason: str) -> RunError:
    return RunError(
        f"run {job.run.name}: its worker or node died {ATTEMPTS} times ({reason}). Run the command again to go on"
    )
