"""How long trials will take is told before they begin."""

import time
from itertools import count
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import RenderError
from clearway.experiments import expected_time, expected_walks
from clearway.experiments.expected_time import told_time
from clearway.experiments.expected_walks import shortest_steps, walking_time
from clearway.experiments.job import request_of
from clearway.experiments.plan import RANDOM_WALK, Job, LiveTrial
from clearway.experiments.reproduce import planned
from clearway.experiments.setting import Setting
from clearway.live.conditions import Condition, Perturbations
from clearway.reward import COLLISION_AWARE
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
    ticks = count(step=10)  # so many seconds from one look at the clock to the next
    monkeypatch.setattr(expected_walks.time, "perf_counter", lambda: float(next(ticks)))
    runs = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    trials = (LiveTrial(SETTINGS, 3, 40), LiveTrial(SETTINGS, 3, 40, walker=RANDOM_WALK))
    bounds = expected_walks.time_of_walks([(run, trial) for run in runs for trial in trials], 1)
    monkeypatch.undo()
    changed = SETTINGS[-1].perturbations
    assert [(sees, wanted) for sees, wanted, _ in seen] == [(("rgb",), changed)] * 2 + [((), changed)] * 2
    assert all(2 <= steps <= 2 * expected_walks.TRIED_LIVE_STEPS for *_, steps in seen)
    seconds = [10 / seen[number][2] for number in (1, 3)]  # a step of who needs pictures, and of who does not
    each = 2 * 2 * 3  # seeds, settings, episodes to each target
    shortest = sum(shortest_steps(in_room.files, in_room.targets))
    assert bounds.straight_s == pytest.approx(sum(seconds) * each * shortest)
    assert bounds.lost_s == pytest.approx(sum(seconds) * each * 2 * 40)  # two targets
    assert not (in_room.out / "runs").exists()


def test_episodes_off_the_grid_are_counted_by_settings(in_room: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    (run, _) = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    monkeypatch.setattr(expected_walks, "live_walking_time", lambda run, trial, threads: 0.5)
    monkeypatch.setattr(expected_walks, "shortest_steps", lambda scenes, targets: [8.0, 4.0])
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: 1e6)
    job = Job(run, (LiveTrial(SETTINGS, 4, 40),))
    told = told_time(in_room.out, [job], [job], 1, 1)
    assert told.endswith("; evaluation 48 s if all go straight, 5 min if all get lost")


def test_what_cannot_be_tried_here_is_told_and_hinders_nothing(
    in_room: Setting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where there are no graphics: who needs no pictures trains all the same."""

    def refuses(*_: object) -> None:
        raise RenderError("no pictures can be rendered here. Install EGL")

    monkeypatch.setattr(expected_walks, "stages", refuses)
    monkeypatch.setattr(expected_time, "frames_per_second", lambda run, threads: 1e6)
    (run, _) = in_room.runs(in_room.learners["paper"], COLLISION_AWARE)
    job = Job(run, (LiveTrial(SETTINGS, 4, 40),))
    told = told_time(in_room.out, [job], [job], 1, 1)
    assert told.endswith("; not all can be tried here: no pictures can be rendered here. Install EGL")
    assert told.startswith("1 runs, 1 to be trained, 1 at a time: ")
