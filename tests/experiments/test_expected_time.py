"""How long a plan will take is told before it begins."""

import time
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path

import pytest
import torch

from clearway.experiments import expected_time
from clearway.experiments.expected_time import frames_per_second, told_time
from clearway.experiments.job import run_folder
from clearway.experiments.reproduce import planned
from clearway.learn.checkpoint import Progress, write_checkpoint
from clearway.learn.presets import PAPER_A3C
from helpers.small_setting import small_setting


def test_the_time_is_the_frames_by_the_speed_and_the_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = planned(small_setting(tmp_path), ["fig4"])
    frames = sum(job.run.learner.frames for job in jobs)
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: frames / 7200)
    assert (
        told_time(tmp_path, jobs, jobs, 2, 1)
        == f"{len(jobs)} runs, {len(jobs)} to be trained, 2 at a time: 1 h 00 min of training here at least"
    )
    on_cluster = told_time(tmp_path, jobs, jobs, None, 1)
    assert on_cluster.endswith("to be trained, one after the other: 2 h 00 min of training here")
    assert told_time(tmp_path, jobs, [], 2, 1) == f"{len(jobs)} runs, 0 to be trained: all is there"


def test_what_has_been_trained_takes_no_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = planned(small_setting(tmp_path), ["fig4"])
    (first, second), frames = jobs[:2], jobs[0].run.learner.frames
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: frames / 7200)
    for run, reached in ((first.run, frames + 3), (second.run, frames // 2)):  # the last update may go beyond
        write_checkpoint(
            run_folder(tmp_path, run).checkpoints, {"weight": torch.zeros(1)}, {}, Progress(reached, 1, 1.0)
        )
    assert told_time(tmp_path, jobs, [first, second], 1, 1) == (
        f"{len(jobs)} runs, 1 to be trained, 1 only to be evaluated, 1 at a time: 1 h 00 min of training here at least"
    )
    assert told_time(tmp_path, jobs, [first], 1, 1) == f"{len(jobs)} runs, 0 to be trained, 1 only to be evaluated"


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
    assert "of training here" in told_time(tmp_path, jobs, jobs, 2, 1)
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
    told = told_time(tmp_path, jobs, jobs, 1, 1)
    assert "of training here at least" in told and not active_children()
