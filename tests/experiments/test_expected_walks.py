"""How long trials will take is told before they begin."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.experiments import expected_time, expected_walks
from clearway.experiments.expected_time import told_time
from clearway.experiments.expected_walks import picture_time, shortest_steps, walking_time
from clearway.experiments.job import request_of, trial_path
from clearway.experiments.plan import RANDOM_WALK, Job, LiveTrial, PerturbedPictures
from clearway.experiments.reproduce import planned
from clearway.experiments.setting import Setting
from clearway.live.conditions import Condition, Perturbations
from clearway.live.live_room import LiveRoom
from clearway.reward import COLLISION_AWARE, SHORTEST
from helpers.live_setting import live_setting
from helpers.small_live import walkable_live
from helpers.small_setting import small_setting

SETTINGS = (Condition("none", Perturbations()), Condition("turn", Perturbations(angle_noise=5.0)))


def test_a_walk_is_tried_by_an_agent_that_has_learnt_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (job, *_) = planned(small_setting(tmp_path), ["fig4"])
    walked, steps = expected_walks.run_episodes, []

    def counted(*arguments, **settings):
        table = walked(*arguments, **settings)
        steps.append(table.steps.sum())
        return table

    monkeypatch.setattr(expected_walks, "run_episodes", counted)
    made, acting = expected_walks.made_agent, {}
    monkeypatch.setattr(expected_walks, "made_agent", lambda *given: acting.update(given[1]) or made(*given))
    began = time.perf_counter()
    found = walking_time(job.run, job.trials[0], threads=1)
    assert 0 < found * steps[0] < time.perf_counter() - began
    assert 15 < steps[0] <= 15 * expected_walks.TRIED_STEPS  # three episodes to each of five targets
    begun = request_of(job.run).trainer().tensors()
    own = {name: tensor for name, tensor in acting.items() if name.startswith("network.")}
    assert own and all(torch.equal(tensor, begun[name]) for name, tensor in own.items())
    assert not (tmp_path / "runs").exists()


def test_shortest_steps_are_means_over_all_starts_target_by_target(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    ways = [
        scene.distances_to(np.array([target]))[0]
        for scene, own in zip(setting.scenes, setting.targets, strict=True)
        for target in own
    ]
    expected = [sum(steps for steps in way.tolist() if steps > 0) / (way > 0).sum() for way in ways]
    assert shortest_steps(setting.files, setting.targets) == pytest.approx(expected)


@pytest.fixture(scope="module")
def live() -> LiveRoom:
    return walkable_live()


@pytest.fixture
def in_room(tmp_path: Path, live: LiveRoom, monkeypatch: pytest.MonkeyPatch) -> Setting:
    return live_setting(tmp_path, live, monkeypatch, seeds=2)


def test_walks_off_the_grid_are_tried_in_the_room_by_who_needs_pictures_and_who_does_not(
    in_room: Setting, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []
    walked = expected_walks.run_live_episodes

    def counted(live, world, agent, camera, perturbations, protocol):
        table = walked(live, world, agent, camera, perturbations, protocol)
        seen.append((agent.sees, perturbations, int(table.steps.sum())))
        return table

    monkeypatch.setattr(expected_walks, "run_live_episodes", counted)
    runs = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    trials = (LiveTrial(SETTINGS, 3, 40), LiveTrial(SETTINGS, 3, 40, walker=RANDOM_WALK))
    jobs = [Job(run, trials) for run in runs]
    began = time.perf_counter()
    expected = expected_walks.expected_walks(in_room.out, jobs, 1)
    taken = time.perf_counter() - began
    assert [(sees, wanted) for sees, wanted, _ in seen] == [(("rgb",), SETTINGS[-1].perturbations)] * 2 + [
        ((), SETTINGS[-1].perturbations)
    ] * 2
    assert 2 <= seen[1][2] <= 2 * expected_walks.TRIED_LIVE_STEPS
    shortest = sum(shortest_steps(in_room.files, in_room.targets))
    lost = 2 * 2 * 3 * 2 * 40  # two targets, settings, three episodes, two seeds
    assert expected.lost_s / expected.straight_s == pytest.approx(lost / (2 * 3 * 2 * shortest))
    assert 0 < expected.lost_s < lost * 2 * taken
    assert not expected.pictures and not expected.others and not (in_room.out / "runs").exists()


def test_episodes_off_the_grid_are_counted_by_settings(in_room: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    (run, _) = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    monkeypatch.setattr(expected_walks, "live_walking_time", lambda run, trial, threads: 0.5)
    monkeypatch.setattr(expected_walks, "shortest_steps", lambda scenes, targets: [8.0, 4.0])
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: 1e6)
    job = Job(run, (LiveTrial(SETTINGS, 4, 40),))
    told = told_time(in_room.out, [job], [job], 1, 1)
    assert told.endswith("; evaluation 48 s if all go straight, 5 min if all get lost")


def test_each_perturbed_picture_is_counted_once(in_room: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the trainings of two seeds, and of two agents' trials with the same seeds."""
    monkeypatch.setattr(expected_walks, "walking_time", lambda run, trial, threads: 0.0)
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: 1e6)
    tried = []
    monkeypatch.setattr(expected_walks, "picture_time", lambda run, pictures, threads: tried.append(run) or 0.25)
    seen = PerturbedPictures(Perturbations(light=0.5), 3)
    learner = in_room.learners["paper"]
    runs = [replace(run, perturbed=seen) for run in in_room.runs(learner, COLLISION_AWARE)]
    runs += in_room.runs(learner, SHORTEST)
    jobs = [Job(run, (replace(in_room.trial(), seed=run.seed, perturbed=seen),)) for run in runs]
    poses = in_room.scenes[0].state_count
    expected = expected_walks.expected_walks(in_room.out, jobs, 1)
    assert (expected.pictures, expected.pictures_s) == (4 * 3 * poses, 3 * poses) and len(tried) == 1
    told = told_time(in_room.out, jobs, jobs, 2, 1)
    assert (
        f"; {12 * poses:,} perturbed pictures {expected_time._duration(1.5 * poses)}, less where they are kept" in told
    )
    for job in jobs[1:]:
        path = trial_path(in_room.out, job.run, job.trials[0])
        path.parent.mkdir(parents=True)
        path.touch()
    left = expected_walks.expected_walks(in_room.out, jobs[2:], 1)
    assert not left.pictures and not left.pictures_s
    assert expected_walks.expected_walks(in_room.out, jobs[:1], 1).pictures == 2 * 3 * poses
    monkeypatch.setattr(expected_walks, "frames_left", lambda out, run: 0)  # it has been trained
    assert expected_walks.expected_walks(in_room.out, jobs[:1], 1).pictures == 3 * poses


def test_a_perturbed_picture_is_tried_from_other_poses_than_the_target(
    in_room: Setting, monkeypatch: pytest.MonkeyPatch
) -> None:
    encoded, encode = [], expected_walks.features_of
    monkeypatch.setattr(
        expected_walks, "features_of", lambda pictures, encoder: encoded.append(pictures) or encode(pictures, encoder)
    )
    (run, _) = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    began = time.perf_counter()
    found = picture_time(run, PerturbedPictures(Perturbations(camera_pitch_jitter=3.0), 2), 1)
    assert 0 < found * expected_walks.TRIED_PICTURES < time.perf_counter() - began
    assert [len(pictures) for pictures in encoded] == [1, expected_walks.TRIED_PICTURES]
    assert len(np.unique(encoded[1].reshape(len(encoded[1]), -1), axis=0)) > expected_walks.TRIED_PICTURES // 2
