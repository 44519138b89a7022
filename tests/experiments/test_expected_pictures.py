"""How long perturbed pictures will take is told before they are taken."""

from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from clearway.experiments import expected_pictures, expected_time, expected_walks
from clearway.experiments.expected_pictures import TRIED_PICTURES, asked, picture_time, time_of_pictures
from clearway.experiments.expected_time import told_time
from clearway.experiments.job import trial_path
from clearway.experiments.plan import Job, PerturbedPictures
from clearway.experiments.setting import Setting
from clearway.live.conditions import Perturbations
from clearway.reward import COLLISION_AWARE, SHORTEST

SEEN = PerturbedPictures(Perturbations(camera_pitch_jitter=3.0), 3)


def pictures_of(out: Path, jobs: list[Job]) -> int:
    return sum(map(len, asked(out, jobs)))


def test_each_perturbed_picture_is_counted_once(in_room: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the trainings of two seeds, and of two agents' trials with the same seeds."""
    monkeypatch.setattr(expected_walks, "walking_time", lambda run, trial, threads: 0.0)
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: 1e6)
    tried = []
    monkeypatch.setattr(expected_pictures, "picture_time", lambda run, pictures, threads: tried.append(run) or 0.25)
    learner = in_room.learners["paper"]
    runs = [replace(run, perturbed=SEEN) for run in in_room.runs(learner, COLLISION_AWARE)]
    runs += in_room.runs(learner, SHORTEST)
    jobs = [Job(run, (replace(in_room.trial(), seed=run.seed, perturbed=SEEN),)) for run in runs]
    poses = in_room.scenes[0].state_count
    assert pictures_of(in_room.out, jobs) == 4 * 3 * poses
    assert time_of_pictures(asked(in_room.out, jobs), 1) == 3 * poses and len(tried) == 1
    told = told_time(in_room.out, jobs, jobs, 2, 1)
    taken = expected_time._duration(1.5 * poses)
    assert f"; {12 * poses:,} perturbed pictures {taken}, less where they are kept" in told
    for job in jobs[1:]:
        path = trial_path(in_room.out, job.run, job.trials[0])
        path.parent.mkdir(parents=True)
        path.touch()
    assert not pictures_of(in_room.out, jobs[2:])
    assert pictures_of(in_room.out, jobs[:1]) == 2 * 3 * poses
    monkeypatch.setattr(expected_pictures, "frames_left", lambda out, run: 0)  # it has been trained
    assert pictures_of(in_room.out, jobs[:1]) == 3 * poses


def test_a_perturbed_picture_is_tried_from_other_poses_than_the_target(
    in_room: Setting, monkeypatch: pytest.MonkeyPatch
) -> None:
    encoded, encode = [], expected_pictures.features_of
    monkeypatch.setattr(
        expected_pictures,
        "features_of",
        lambda pictures, encoder: encoded.append(pictures) or encode(pictures, encoder),
    )
    walking, stands = expected_pictures.Walking, []

    def noted(live, start, target, draws):
        stands.append((start, target, draws.perturbations))
        return walking(live, start, target, draws)

    monkeypatch.setattr(expected_pictures, "Walking", noted)
    ticks = count(step=8)
    monkeypatch.setattr(expected_pictures.time, "perf_counter", lambda: float(next(ticks)))
    (run, _) = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    assert picture_time(run, SEEN, 1) == 8 / TRIED_PICTURES
    assert [len(pictures) for pictures in encoded] == [1, TRIED_PICTURES]
    assert len(np.unique(encoded[1].reshape(TRIED_PICTURES, -1), axis=0)) > TRIED_PICTURES // 2
    assert {(target, wanted) for _, target, wanted in stands} == {(5, SEEN.perturbations)}
    starts = [start for start, *_ in stands]
    assert len(set(starts)) == len(starts) == TRIED_PICTURES + 1 > 5 not in starts
