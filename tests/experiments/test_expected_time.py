"""How long a plan will take is told before it begins."""

import time
from dataclasses import dataclass, replace
from multiprocessing import active_children
from pathlib import Path

import pytest
import torch

from clearway.experiments import expected_time, expected_walks
from clearway.experiments.expected_time import _duration, frames_per_second, told_time
from clearway.experiments.job import run_folder, trial_path
from clearway.experiments.reproduce import planned
from clearway.learn.a2c import A2C
from clearway.learn.checkpoint import Progress, write_checkpoint
from clearway.learn.presets import PAPER_A3C
from helpers.small_setting import small_setting


def test_the_time_is_the_frames_by_the_speed_and_the_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = planned(small_setting(tmp_path), ["fig4"])
    frames = sum(job.run.learner.frames for job in jobs)
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: frames / 7200)
    monkeypatch.setattr(expected_walks, "walking_time", lambda run, trial, threads: 0.125)
    monkeypatch.setattr(expected_walks, "shortest_steps", lambda scenes, targets: [8.0] * sum(map(len, targets)))
    episodes = 2 * len(jobs) * 5 * 3  # at the end and halfway, three to each of five targets; of 8 to 40 steps
    walked = f"evaluation {_duration(episodes / 2)} if all go straight, {_duration(episodes * 5 / 2)} if all get lost"
    assert (
        told_time(tmp_path, jobs, jobs, 2, 1)
        == f"{len(jobs)} runs, {len(jobs)} to be trained, 2 at a time: 1 h 00 min of training here at least; {walked}"
    )
    on_cluster = told_time(tmp_path, jobs, jobs, None, 1)
    assert "to be trained, one after the other: 2 h 00 min of training here; evaluation " in on_cluster
    assert told_time(tmp_path, jobs, [], 2, 1) == f"{len(jobs)} runs, 0 to be trained: all is there"


def test_what_has_been_trained_takes_no_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = planned(small_setting(tmp_path), ["fig4"])
    (first, second), frames = jobs[:2], jobs[0].run.learner.frames
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: frames / 7200)
    monkeypatch.setattr(expected_walks, "walking_time", lambda run, trial, threads: 0.125)
    monkeypatch.setattr(expected_walks, "shortest_steps", lambda scenes, targets: [8.0] * sum(map(len, targets)))
    for run, reached in ((first.run, frames + 3), (second.run, frames // 2)):  # the last update may go beyond
        write_checkpoint(
            run_folder(tmp_path, run).checkpoints, {"weight": torch.zeros(1)}, {}, Progress(reached, 1, 1.0)
        )
    assert told_time(tmp_path, jobs, [first, second], 1, 1) == (
        f"{len(jobs)} runs, 1 to be trained, 1 only to be evaluated, 1 at a time: 1 h 00 min of training here at least"
        "; evaluation 60 s if all go straight, 5 min if all get lost"
    )
    for trial in first.trials[1:]:
        path = trial_path(tmp_path, first.run, trial)
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert told_time(tmp_path, jobs, [first], 1, 1) == (
        f"{len(jobs)} runs, 0 to be trained, 1 only to be evaluated; "
        "evaluation 15 s if all go straight, 75 s if all get lost"
    )


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


@dataclass(frozen=True)
class Foreign(A2C):
    """Another package's algorithm."""


def test_episodes_of_other_packages_agents_are_counted_not_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (job, *_) = planned(small_setting(tmp_path), ["fig4"])
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: 1e6)
    foreign = replace(job, run=replace(job.run, learner=Foreign(frames=100)))
    told = told_time(tmp_path, [foreign], [foreign], 1, 1)
    assert told.endswith("of training here at least; 30 episodes of other packages' agents")


def test_asynchronous_workers_are_tried_too_and_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (job, *_) = planned(small_setting(tmp_path), ["fig4"])
    monkeypatch.setattr(expected_time, "TRIED_S", 0.1)
    learner = replace(PAPER_A3C, width=8, feature_basis=8, frames=1_000_000)
    jobs = [replace(job, run=replace(job.run, learner=learner))] * 2
    told = told_time(tmp_path, jobs, jobs, 1, 1)
    assert "of training here at least" in told and not active_children()
