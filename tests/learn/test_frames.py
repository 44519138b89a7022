"""Frames are used as they were asked for: the last rollout is cut."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.learn import running, train
from clearway.learn.algorithms import ALGORITHMS
from clearway.learn.checkpoint import newest_checkpoint, read_network
from clearway.learn.learner import next_steps
from clearway.reward import COLLISION_AWARE
from helpers.small_runs import equal_bits, small_learner, small_request, small_world

CUT = ("ppo", "a2c", "bc", "q-learning")


def test_steps_of_the_next_rollout():
    assert next_steps(0, 20_000, 400, 20) == 20
    assert next_steps(16_000, 20_000, 400, 20) == 10
    assert next_steps(16_000, 20_001, 400, 20) == 11  # a step is one of all environments
    assert next_steps(19_999, 20_000, 400, 20, least=4) == 4
    assert next_steps(16_000, 16_000, 400, 20) == 1


@pytest.mark.parametrize("name", CUT)
def test_no_more_frames_are_used_than_asked_for(name: str):
    learner = small_learner(ALGORITHMS[name](), frames=250)  # 3 rollouts of 80 and one step
    trainer = learner.trainer(small_world(), learner.paid(COLLISION_AWARE), 0)
    used = []
    while not trainer.finished:
        trainer.update()
        used.append(trainer.frames)
    least = 260 if name == "ppo" else 250  # 3 environments in the corridor, and 4 minibatches: 2 steps
    assert used == [80, 160, 240, least]


def test_a_run_that_is_cut_goes_on_to_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    request = small_request(learner=small_learner(frames=290))
    whole = train.train(request, tmp_path / "whole")

    class Stop(Exception):
        pass

    saved = running.save
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", -1.0)

    def stop(*given: object) -> None:
        saved(*given)
        if given[0].frames == 240:
            raise Stop

    monkeypatch.setattr(running, "save", stop)
    with pytest.raises(Stop):
        train.train(request, tmp_path / "run")
    monkeypatch.setattr(running, "save", saved)
    resumed = train.train(request, tmp_path / "run", resume=True)
    networks = [read_network(newest_checkpoint(folder.checkpoints)) for folder in (whole, resumed)]
    assert equal_bits(*networks)
    assert [row["frames"] for row in whole.metrics()] == [80, 160, 240, 290]
