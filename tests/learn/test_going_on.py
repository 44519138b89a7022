"""Runs that are made longer, that stop once all is solved, and what they tell of targets."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from clearway.errors import RunError
from clearway.learn import train
from clearway.learn.bc import BC
from clearway.learn.checkpoint import newest_checkpoint, read_progress
from clearway.learn.figures import Figures
from clearway.learn.learner import Learner
from clearway.learn.q_learning import QLearning
from clearway.learn.run_folder import RunFolder
from clearway.learn.solved import SUCCESS, unsolved_targets
from clearway.learn.train import RunRequest
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from helpers.made import corridor_scene
from helpers.small_runs import CORRIDOR_TARGETS, FEATURES, small_learner, small_request, small_scenes


def of_frames(frames: int) -> RunRequest:
    return small_request(learner=small_learner(frames=frames))


def frames_of(folder: RunFolder) -> int:
    return read_progress(newest_checkpoint(folder.checkpoints)).frames


def tell_success(monkeypatch: pytest.MonkeyPatch, frames: int, success: list[float]) -> None:
    """From so many frames on, let each target's success rate be this."""
    whole = Trainer.update

    def update(trainer: Trainer) -> Figures:
        figures = whole(trainer)
        if trainer.frames >= frames:
            trainer.statistics.recent_success[:] = torch.tensor(success, dtype=torch.float64)
        return figures

    monkeypatch.setattr(Trainer, "update", update)


@pytest.mark.slow
def test_a_finished_run_is_made_longer_and_says_so(tmp_path: Path) -> None:
    train.train(of_frames(800), tmp_path)
    with pytest.warns(UserWarning, match="was finished after 800 frames, and goes on to 1,600; results"):
        folder = train.train(of_frames(1600), tmp_path, resume=True)
    assert frames_of(folder) == folder.read_record().learner.frames == 1600
    assert [row["frames"] for row in folder.metrics()] == [80 * k for k in range(1, 21)]
    train.train(of_frames(1600), tmp_path, resume=True)  # finished again, and goes on without a word


@pytest.mark.parametrize(("frames", "remedy"), [(400, "more than 800"), (799, "more than 800")])
def test_a_run_is_not_made_shorter(tmp_path: Path, frames: int, remedy: str) -> None:
    train.train(of_frames(800), tmp_path)
    with pytest.raises(RunError, match=rf"started for 800 frames.* Give --frames 800, {remedy}, or another --out"):
        train.train(of_frames(frames), tmp_path, resume=True)


def test_a_run_under_way_keeps_its_schedules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        tell_success(patch, 400, [1.0] * 5)
        train.train(of_frames(800), tmp_path, until_solved=True)
    with pytest.raises(RunError, match=r"started for 800 frames, and its schedules end there. Give --frames 800, or"):
        train.train(of_frames(1600), tmp_path, resume=True)


def test_a_run_stops_once_every_target_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    request = small_request(learner=small_learner(frames=80_000))  # a row every 400 frames
    with monkeypatch.context() as patch:
        tell_success(patch, 560, [1.0] * 5)
        folder = train.train(request, tmp_path, until_solved=True)
    assert frames_of(folder) == 560
    assert [(row["frames"], row["solved_targets"]) for row in folder.metrics()] == [(400, 0), (560, 5)]
    train.train(request, tmp_path, resume=True, until_solved=True)  # solved already
    assert frames_of(folder) == 560


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", [QLearning(), BC()], ids=["q-learning", "bc"])
def test_whoever_solves_every_target_stops(algorithm: Learner, tmp_path: Path) -> None:
    scene = corridor_scene(5, feature_count=FEATURES)
    learner = small_learner(algorithm, frames=200_000)
    request = RunRequest([scene], {"corridor": CORRIDOR_TARGETS}, learner, COLLISION_AWARE, seed=0)
    folder = train.train(request, tmp_path, until_solved=True)
    assert frames_of(folder) < 100_000
    assert folder.metrics()[-1]["solved_targets"] == 3
    assert unsolved_targets(folder) == {}


def test_a_run_that_solves_not_every_target_uses_all_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tell_success(monkeypatch, 80, [1.0, 1.0, 0.95, 1.0, 1.0])
    assert frames_of(train.train(of_frames(800), tmp_path / "until", until_solved=True)) == 800
    tell_success(monkeypatch, 80, [1.0] * 5)
    assert frames_of(train.train(of_frames(800), tmp_path / "all")) == 800


def test_unsolved_targets_by_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tell_success(monkeypatch, 800, [1.0, 0.5, 1.0, 1.0, 0.0])
    assert unsolved_targets(train.train(of_frames(800), tmp_path)) == {"corridor": (8,), "grid": (22,)}


@pytest.mark.slow
def test_unsolved_targets_among_own_goals(tmp_path: Path) -> None:
    learner = small_learner(goals="seen")
    request = small_request(learner=learner)
    assert unsolved_targets(train.train(request, tmp_path / "two")) == {}  # cannot be told
    one = replace(request, scenes=small_scenes()[:1], targets={"corridor": (8, 0, 16)})
    assert unsolved_targets(train.train(one, tmp_path / "one")) == {"corridor": (8, 0, 16)}


def test_algorithms_that_tell_of_no_target(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = train.train(of_frames(800), tmp_path)
    monkeypatch.setattr("clearway.learn.solved.read_training", lambda path: {})
    assert unsolved_targets(folder) == {}
    assert SUCCESS == "statistics.recent_success"


def test_what_begins_is_told_before_the_first_frame(tmp_path: Path) -> None:
    told = []
    train.train(of_frames(800), tmp_path, on_begin=lambda path: told.append((path, RunFolder(path).metrics())))
    assert told == [(tmp_path, [])]
