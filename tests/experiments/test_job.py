import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import RunError
from clearway.experiments.groups import PAIR, all_jobs, compared
from clearway.experiments.job import do, episodes_of, is_done, run_folder, trial_path, unfinished
from clearway.experiments.plan import Job
from clearway.experiments.trajectories import maps
from clearway.learn import train
from clearway.learn.figures import Figures
from clearway.learn.run_folder import RunFolder
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.spread.messages import from_message, to_message
from clearway.world.world import World
from helpers import own_terms
from helpers.agents import Spy
from helpers.small_setting import small_setting


def made_job(out: Path) -> Job:
    setting = small_setting(out, seeds=1)
    learner = replace(setting.learners["default"], frames=400, lr_start=1e-2, lr_end=1e-2)  # every update shows
    (run,) = setting.runs(learner, COLLISION_AWARE)
    return Job(run, (setting.trial(), setting.trial(halfway=True), setting.trial(((1,), (2, 3)))))


def test_a_job_trains_and_walks_its_trials(tmp_path: Path) -> None:
    job = made_job(tmp_path)
    assert not is_done(tmp_path, job)
    assert episodes_of(tmp_path, job.run, job.trials[0]) is None
    do(tmp_path, job, threads=1)
    assert is_done(tmp_path, job)
    end, halfway, elsewhere = (episodes_of(tmp_path, job.run, trial) for trial in job.trials)
    assert len(end) == len(halfway) == 3 * 5
    assert len(elsewhere) == 3 * 3
    np.testing.assert_array_equal(end.start, halfway.start)  # the same starts
    assert (end.steps != halfway.steps).any()  # another agent


def test_a_job_that_is_done_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = made_job(tmp_path)
    do(tmp_path, job, threads=1)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.json*")}
    monkeypatch.setattr(Trainer, "update", lambda self: pytest.fail("trains again"))
    do(tmp_path, job, threads=1)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.json*")} == before


def test_a_job_whose_reward_is_another_here_than_where_it_was_planned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a process that was started after the module had been edited."""
    job, module = made_job(tmp_path), own_terms.imported(tmp_path / "turning.py", monkeypatch)
    job = replace(job, run=replace(job.run, reward=module.REWARD))
    name, message = job.run.name, to_message(job)
    assert from_message(message).run.name == name
    own_terms.imported(tmp_path / "turning.py", monkeypatch, own_terms.DEARER)
    with pytest.raises(RunError, match=f"run {name}: the code of its reward's terms has changed since it was planned"):
        do(tmp_path, from_message(message), threads=1)
    assert not run_folder(tmp_path, job.run).path.exists()


def test_a_run_whose_weights_are_gone_begins_anew_with_all_its_trials(tmp_path: Path) -> None:
    """As of a record, of which more is asked: no report shall mix two agents."""
    job = made_job(tmp_path)
    first = replace(job, trials=job.trials[:2])
    do(tmp_path, first, threads=1)
    folder = run_folder(tmp_path, job.run)
    shutil.rmtree(folder.checkpoints)
    shutil.rmtree(folder.path / "milestones")
    before = [trial_path(tmp_path, job.run, trial) for trial in first.trials]
    for path in before:
        path.write_text("an agent that is no more")
    assert is_done(tmp_path, first) and not is_done(tmp_path, job)
    do(tmp_path, job, threads=1)
    assert is_done(tmp_path, job) and all(path.read_text().startswith("{") for path in before)


def test_trials_of_a_record_stay_where_training_cannot_begin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = made_job(tmp_path)
    first = replace(job, trials=job.trials[:1])
    do(tmp_path, first, threads=1)
    shutil.rmtree(run_folder(tmp_path, job.run).checkpoints)
    kept = trial_path(tmp_path, job.run, job.trials[0]).read_bytes()

    def refuses(*_: object) -> None:
        raise RunError("in use")

    monkeypatch.setattr(RunFolder, "held", refuses)
    with pytest.raises(RunError, match="in use"):
        do(tmp_path, job, threads=1)
    assert trial_path(tmp_path, job.run, job.trials[0]).read_bytes() == kept


class OnSight:
    """Stands in for what a run has learnt: walks at random, and sees pictures."""

    def __init__(self) -> None:
        self.walkers: list[Spy] = []

    def on_poses(self, world: World) -> Spy:
        self.walkers.append(Spy("rgb"))
        return self.walkers[-1]


def test_agents_that_see_pictures_are_shown_them_in_trials_and_for_maps(tmp_path: Path, monkeypatch) -> None:
    setting = small_setting(tmp_path, seeds=1)
    setting = replace(setting, learners={"default": setting.learners["default"]})
    groups, made = compared(setting, PAIR), OnSight()
    monkeypatch.setattr("clearway.experiments.grid_trial.load_agent", lambda *_: made)
    monkeypatch.setattr("clearway.experiments.trajectories.load_agent", lambda *_: made)
    for each in all_jobs(groups):
        do(tmp_path, each, threads=1)
    assert [drawn.scene for drawn in maps(setting, groups)] == ["bathroom", "kitchen"]
    assert len(made.walkers) == 4
    shown = setting.scenes[0].seen_by("rgb").shape[1:]
    for walker in made.walkers:
        assert {seen["rgb"].shape[1:] for seen in (*walker.targets, *walker.seen)} == {shown}


@pytest.mark.slow
def test_an_interrupted_job_ends_with_the_same_episodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = made_job(tmp_path / "whole")
    do(tmp_path / "whole", job, threads=1)
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    update, left = Trainer.update, 3

    def stop_after_some(self: Trainer) -> Figures:
        nonlocal left
        left -= 1
        if left < 0:
            raise KeyboardInterrupt
        return update(self)

    monkeypatch.setattr(Trainer, "update", stop_after_some)
    with pytest.raises(KeyboardInterrupt):
        do(tmp_path / "torn", job, threads=1)
    monkeypatch.setattr(Trainer, "update", update)
    do(tmp_path / "torn", job, threads=1)
    for trial in job.trials:
        first, second = (episodes_of(tmp_path / name, job.run, trial) for name in ("whole", "torn"))
        np.testing.assert_array_equal(first.steps, second.steps)
        np.testing.assert_array_equal(first.collisions, second.collisions)


def test_a_scene_that_has_changed_is_refused(tmp_path: Path) -> None:
    job = made_job(tmp_path)
    changed = tuple(replace(scene, digest="0" * 16) for scene in job.run.scenes)
    with pytest.raises(RunError, match=r"has changed.*--out"):
        do(tmp_path, Job(replace(job.run, scenes=changed), job.trials), threads=1)


def test_a_run_keeps_its_halfway_even_where_nothing_is_tried_there_yet(tmp_path: Path) -> None:
    job = made_job(tmp_path)
    at_the_end, halfway, _ = job.trials
    do(tmp_path, Job(job.run, (at_the_end,)), threads=1)
    do(tmp_path, Job(job.run, (halfway,)), threads=1)
    assert episodes_of(tmp_path, job.run, halfway) is not None


def test_milestones_are_kept_beside_the_checkpoints(tmp_path: Path) -> None:
    job = made_job(tmp_path)
    do(tmp_path, job, threads=1)
    folder = run_folder(tmp_path, job.run)
    assert [path.name for path in folder.milestone(job.run.halfway).iterdir()] == ["frames-000000000240"]


def test_a_job_without_trials_is_done_once_it_is_trained(tmp_path: Path) -> None:
    job = replace(made_job(tmp_path), trials=())
    assert not is_done(tmp_path, job) and unfinished(tmp_path, [job]) == (job.run.name,)
    do(tmp_path, job, threads=1)
    assert is_done(tmp_path, job) and not unfinished(tmp_path, [job])
    shutil.rmtree(run_folder(tmp_path, job.run).checkpoints)  # its figures alone are no agent
    assert not is_done(tmp_path, job)


def test_targets_may_be_numpy_s(tmp_path: Path) -> None:
    job = made_job(tmp_path)
    targets = tuple(tuple(np.array(own)) for own in job.run.targets)
    numpys = Job(replace(job.run, targets=targets), (replace(job.trials[0], targets=targets),))
    assert numpys == Job(job.run, job.trials[:1]) and numpys.run.name == job.run.name
    assert {type(target) for each in (numpys.run, *numpys.trials) for own in each.targets for target in own} == {int}
    do(tmp_path, numpys, threads=1)
    assert is_done(tmp_path, Job(job.run, job.trials[:1]))
