import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from clearway.errors import RunError, SceneError
from clearway.experiments import jobs as experiment_jobs
from clearway.experiments.job import do, episodes_of, is_done, run_folder
from clearway.experiments.jobs import affordable_workers, run_jobs
from clearway.experiments.plan import Job
from clearway.experiments.setting import Setting
from clearway.learn.run_folder import RunFolder
from clearway.reward import COLLISION_AWARE
from helpers.small_setting import small_setting
from helpers.spread_parts import workers_of

needs_proc = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")


def jobs_of(setting: Setting) -> list[Job]:
    runs = setting.runs(setting.learners["default"], COLLISION_AWARE)
    return [Job(run, (setting.trial(),)) for run in runs]


def nothing(under_way: Sequence[Job]) -> None:
    """Show nothing."""


@pytest.mark.slow
@needs_proc
def test_jobs_in_processes_give_what_one_gives_here(tmp_path: Path) -> None:
    """One worker is killed on the way and begins again."""
    here, there = small_setting(tmp_path / "here"), small_setting(tmp_path / "there")
    for job in jobs_of(here):
        do(here.out, job, threads=1)
    killed: list[int] = []

    def kill_once(under_way: Sequence[Job]) -> None:
        workers = workers_of(os.getpid())
        if workers and not killed:
            killed.append(workers[0])
            os.kill(workers[0], signal.SIGKILL)

    run_jobs(there.out, jobs_of(there), workers=2, threads=1, show=kill_once)
    assert killed
    for first, second in zip(jobs_of(here), jobs_of(there), strict=True):
        assert first.run.name == second.run.name
        tables = [episodes_of(s.out, j.run, j.trials[0]) for s, j in ((here, first), (there, second))]
        assert (tables[0].steps == tables[1].steps).all()
        assert (tables[0].collisions == tables[1].collisions).all()


@pytest.mark.slow
def test_what_the_user_did_wrong_is_said_in_one_line(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    jobs = jobs_of(setting)
    setting.files[0].path.write_bytes(b"not a scene")
    with pytest.raises(SceneError, match=r"bathroom\.h5"):
        run_jobs(setting.out, jobs, workers=1, threads=1, show=nothing)
    assert not any(is_done(setting.out, job) for job in jobs)


@needs_proc
def test_a_run_that_is_killed_every_time_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setting = small_setting(tmp_path, seeds=1)
    monkeypatch.setattr(experiment_jobs, "ATTEMPTS", 2)
    killed: set[int] = set()

    def kill(under_way: Sequence[Job]) -> None:
        for worker in workers_of(os.getpid()):
            killed.add(worker)
            os.kill(worker, signal.SIGKILL)

    (job,) = jobs_of(setting)
    with pytest.raises(RunError, match=r"SIGKILL, attempt 2.*run the command again"):
        run_jobs(setting.out, [job], workers=1, threads=1, show=kill)
    assert len(killed) == 2


@pytest.mark.slow
@needs_proc
def test_an_interruption_stops_all_workers_and_leaves_what_can_be_resumed(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    jobs = jobs_of(setting)

    def interrupt(under_way: Sequence[Job]) -> None:
        if any(run_folder(setting.out, job.run).exists for job in jobs):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_jobs(setting.out, jobs, workers=2, threads=1, show=interrupt)
    assert not workers_of(os.getpid())
    for job in jobs:
        do(setting.out, job, threads=1)
    assert all(is_done(setting.out, job) for job in jobs)


def endless_command(folder: Path) -> list[str]:
    """`clearway reproduce` on the small rooms, too long to end by itself; runs go to the folder `out` in it."""
    small_setting(folder)
    words = ["--budget", "smoke", "--scenes", folder / "scenes", "--out", folder / "out", "--frames", "10000000"]
    return [sys.executable, "-m", "clearway", "reproduce", "fig3", "--learners", "paper", *map(str, words)]


def wait_until(happens: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Come back when something is so, which cannot be once the process has ended."""
    while not happens():
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)


@pytest.mark.slow
@needs_proc
def test_ctrl_c_is_said_once_and_not_by_workers(tmp_path: Path) -> None:
    """The terminal sends SIGINT to every process of the group, also to workers that have just been started."""
    with subprocess.Popen(
        endless_command(tmp_path), stderr=subprocess.PIPE, start_new_session=True, text=True
    ) as process:
        wait_until(lambda: len(workers_of(process.pid)) > 0, process)
        os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "interrupted" in said


@pytest.mark.slow
def test_a_killed_command_leaves_no_worker_that_keeps_its_runs_locked(tmp_path: Path) -> None:
    with subprocess.Popen(endless_command(tmp_path), stderr=subprocess.PIPE, text=True) as process:
        wait_until(lambda: any(tmp_path.glob("out/runs/*/metrics.jsonl")), process)
        process.kill()
        process.communicate(timeout=120)  # until no worker has standard error open any more
    runs = [metrics.parent for metrics in tmp_path.glob("out/runs/*/metrics.jsonl")]
    assert runs
    for run in runs:
        with RunFolder(run).held():  # raises where somebody holds it
            pass


def test_memory_limits_the_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiment_jobs, "free_bytes", lambda: 3 * experiment_jobs.JOB_BYTES)
    with pytest.warns(UserWarning, match=r"3 runs side by side instead of 8: one may take 1 GB, 3\.0 are free"):
        assert affordable_workers(8, threads=1) == 3
    assert affordable_workers(2, threads=1) == 2
    monkeypatch.setattr(experiment_jobs, "free_bytes", lambda: 0)
    with pytest.warns(UserWarning, match="1 runs side by side instead of 8"):
        assert affordable_workers(8, threads=1) == 1
    assert affordable_workers(None, threads=1) == 1  # nothing to be told of
    monkeypatch.setattr(experiment_jobs, "free_bytes", lambda: None)
    assert affordable_workers(8, threads=1) == 8
