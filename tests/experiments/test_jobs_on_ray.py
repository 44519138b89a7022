"""Jobs on Ray. Slow: starting a cluster takes some ten seconds."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from clearway.errors import ClearwayError, RunError
from clearway.experiments.job import do, episodes_of, is_done, run_folder
from clearway.experiments.jobs import run_jobs
from clearway.experiments.plan import Job
from clearway.experiments.setting import Setting
from clearway.learn.checkpoint import newest_checkpoint, read_progress
from clearway.reward import COLLISION_AWARE
from helpers.on_ray import MARKS, ray
from helpers.small_setting import small_setting

pytestmark = MARKS
services = pytest.importorskip("ray._private.services")


@pytest.fixture(autouse=True)
def _disconnected() -> Iterator[None]:
    yield
    ray.shutdown()


def jobs_of(setting: Setting, frames: int = 800) -> list[Job]:
    learner = replace(setting.learners["default"], frames=frames)
    return [Job(run, (setting.trial(),)) for run in setting.runs(learner, COLLISION_AWARE)]


def nothing(under_way: Sequence[Job]) -> None:
    """Show nothing."""


def same_episodes(first: Setting, second: Setting, frames: int) -> bool:
    pairs = zip(jobs_of(first, frames), jobs_of(second, frames), strict=True)
    tables = [
        [episodes_of(s.out, job.run, job.trials[0]) for s, job in zip((first, second), pair, strict=True)]
        for pair in pairs
    ]
    return all((a.steps == b.steps).all() and (a.collisions == b.collisions).all() for a, b in tables)


def test_a_cluster_gives_what_this_process_gives_though_a_node_is_killed(tmp_path: Path) -> None:
    from ray.cluster_utils import Cluster

    frames = 80 * 600
    here, there = small_setting(tmp_path / "here"), small_setting(tmp_path / "there")
    for job in jobs_of(here, frames):
        do(here.out, job, threads=1)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    doomed = [cluster.add_node(num_cpus=1)]
    jobs = jobs_of(there, frames)

    def kill_a_node(under_way: Sequence[Job]) -> None:
        if doomed and all(run_folder(there.out, job.run).metrics() for job in jobs):
            cluster.remove_node(doomed.pop(), allow_graceful=False)

    try:
        run_jobs(there.out, jobs, ray=cluster.address, workers=None, threads=1, show=kill_a_node)
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert not doomed, "both runs were over before the node was killed"
    assert same_episodes(here, there, frames)


def test_an_interruption_saves_a_checkpoint_of_what_is_under_way(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    jobs = jobs_of(setting, frames=80 * 100_000)
    seen: set[str] = set()

    def interrupt(under_way: Sequence[Job]) -> None:
        seen.update(job.run.name for job in under_way)
        if any(run_folder(setting.out, job.run).metrics() for job in under_way):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_jobs(setting.out, jobs, ray="local", workers=1, threads=1, show=interrupt)
    assert len(seen) == 1  # the other one was waiting for the only processor
    (job,) = [job for job in jobs if job.run.name in seen]
    assert read_progress(newest_checkpoint(run_folder(setting.out, job.run).checkpoints)).frames > 0


def test_what_the_user_did_wrong_is_said_as_on_one_machine(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=1)
    (job,) = jobs_of(setting)
    setting.files[0].path.write_bytes(b"not a scene")
    with pytest.raises(ClearwayError, match=r"bathroom\.h5"):
        run_jobs(setting.out, [job], ray="local", workers=1, threads=1, show=nothing)
    assert not is_done(setting.out, job)


def test_more_threads_than_any_node_has_are_refused(tmp_path: Path) -> None:
    setting = small_setting(tmp_path, seeds=1)
    ray.init("local", num_cpus=2, include_dashboard=False)
    with pytest.raises(RunError, match=r"no node .* the 3 processors .*there are 2 and .*--threads"):
        run_jobs(setting.out, jobs_of(setting), ray="local", workers=None, threads=3, show=nothing)


def test_a_cluster_that_is_not_there_is_said_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        services, "find_gcs_addresses", cache(set)
    )  # another test's cluster, which runs beside this one
    monkeypatch.setattr(services, "find_bootstrap_address", lambda *_: None)
    setting = small_setting(tmp_path, seeds=1)
    with pytest.raises(RunError, match=r"--ray auto: no cluster.*--ray local"):
        run_jobs(setting.out, jobs_of(setting), ray="auto", workers=None, threads=1, show=nothing)
