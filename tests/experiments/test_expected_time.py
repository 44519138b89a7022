"""How long a plan will take is told before it begins."""

import time
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path

import pytest

from clearway.experiments import expected_time
from clearway.experiments.expected_time import frames_per_second, told_time
from clearway.experiments.reproduce import planned
from clearway.learn.presets import PAPER_A3C
from helpers.small_setting import small_setting


def test_the_time_is_the_frames_by_the_speed_and_the_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = planned(small_setting(tmp_path), ["fig4"])
    frames = sum(job.run.learner.frames for job in jobs)
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: frames / 7200)
    assert (
        told_time(jobs, jobs, 2, 1)
        == f"{len(jobs)} runs, {len(jobs)} to be trained, 2 at a time: 1 h 00 min of training here at least"
    )
    on_cluster = told_time(jobs, jobs, None, 1)
    assert on_cluster.endswith("to be trained, one after the other: 2 h 00 min of training here")
    assert told_time(jobs, [], 2, 1) == f"{len(jobs)} runs, 0 to be trained: all is there"


def test_each_kind_of_learner_is_tried_once_and_nothing_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = planned(small_setting(tmp_path), ["fig4"])
    monkeypatch.setattr(expected_time, "TRIED_S", 0.05)
    tried, measure = [], expected_time.frames_per_second

    def counted(run, threads):
        tried.append(run)
        return measure(run, threads)

    monkeypatch.setattr(expected_time, "frames_per_second", counted)
    assert "of training here" in told_time(jobs, jobs, 2, 1)
    assert len(tried) == 2 < len(jobs)
    assert not (tmp_path / "runs").exists()


def test_a_speed_is_frames_by_seconds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (job, *_) = planned(small_setting(tmp_path), ["fig4"])
    monkeypatch.setattr(expected_time, "TRIED_S", 0.1)
    began = time.perf_counter()
    speed = frames_per_second(job.run, threads=1)
    assert 0 < speed < job.run.learner.frames / 1e-4 and time.perf_counter() - began < 60


def test_asynchronous_workers_are_tried_too_and_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (job, *_) = planned(small_setting(tmp_path), ["fig4"])
    monkeypatch.setattr(expected_time, "TRIED_S", 0.1)
    learner = replace(PAPER_A3C, width=8, feature_basis=8, frames=1_000_000)
    jobs = [replace(job, run=replace(job.run, learner=learner))] * 2
    told = told_time(jobs, jobs, 1, 1)
    assert "of training here at least" in told and not active_children()
