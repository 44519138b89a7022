"""Adapting the generalist: its walks, what was seen of a world, lessons in mind, and whole runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from clearway.errors import RunError, SceneError
from clearway.learn.adapt import Adapt
from clearway.learn.adapting import AdaptingTrainer
from clearway.learn.guided_walks import guided_walks
from clearway.learn.mind_walks import MindWalks
from clearway.learn.teacher import UNKNOWN, Teacher
from clearway.learn.train import RunRequest, train
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import Action
from clearway.scenes.scene import Scene
from clearway.world.world import World, make_world
from helpers.made import corridor_scene, grid_scene
from helpers.small_eyes import seen_by_eyes, ship, small_generalist
from helpers.small_runs import corridor_world, goes_on_to_the_same_bits, reached_from_everywhere

LEARNER = Adapt(
    envs=20, rollout_steps=10, step_limit=20, width=32, minibatches=2, tour_steps=40, walks=2, walk_steps=10
)
LEARNER = replace(LEARNER, frames=900, lessons=16, mind_walks=80, lr_start=3e-3, lr_end=1e-3)
TARGETS = {"corridor": [0, 8, 16], "grid": [5, 22]}


@pytest.fixture
def scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Scene]:
    seen = seen_by_eyes(tmp_path / "eyes", corridor_scene(5), grid_scene(1, width=4, depth=3))
    ship(small_generalist(tmp_path / "eyes"), monkeypatch)
    return seen


@pytest.fixture
def world(scenes: list[Scene]) -> World:
    return make_world(scenes, TARGETS)


def trainer_of(world: World, seed: int = 0) -> AdaptingTrainer:
    return LEARNER.trainer(world, COLLISION_AWARE, seed)


@pytest.mark.slow
def test_the_generalist_walks_by_the_rules_of_the_world_and_its_steps_are_frames(world: World):
    trainer = trainer_of(world)
    walked = guided_walks(world, trainer.generalist, LEARNER, seed=0)
    assert torch.equal(walked.arrived, world.next_state[walked.state, walked.action])
    tours, walks = 2 * LEARNER.tour_steps, 5 * LEARNER.walks * LEARNER.walk_steps
    assert tours + 5 * LEARNER.walks <= len(walked) <= tours + walks
    assert set((walked.state >= world.scene_offset[1]).tolist()) == {False, True}
    trainer.update()
    assert (trainer.frames, trainer.updates) == (len(walked), 1)
    known = trainer.observed.next_state != UNKNOWN
    assert int(known.sum()) == len({*zip(walked.state.tolist(), walked.action.tolist(), strict=True)})
    other = guided_walks(world, trainer.generalist, LEARNER, seed=1)
    assert len(other) != len(walked) or not torch.equal(other.state, walked.state)


@pytest.mark.slow
def test_a_walk_of_the_generalist_is_over_at_its_target(world: World):
    walked = guided_walks(world, trainer_of(world).generalist, replace(LEARNER, tour_steps=1, walk_steps=150), seed=0)
    assert len(walked) < 5 * LEARNER.walks * 150  # chance brings even these eyes there


def test_a_teacher_plans_in_what_was_seen_alone():
    world = corridor_world()
    ahead = torch.full_like(world.next_state, UNKNOWN)
    forward = int(Action.MOVE_FORWARD)
    ahead[[0, 4, 8], forward] = world.next_state[[0, 4, 8], forward]  # 0 -> 4 -> 8 -> 12
    teacher = Teacher(world, COLLISION_AWARE, 0.5, ahead)
    assert teacher.pairs.tolist() == [[1, 0], [1, 4]]  # towards target 1, which is state 8
    target, state = torch.tensor([1, 1, 1, 0]), torch.tensor([0, 4, 16, 4])
    assert teacher.has(target, state).tolist() == [True, True, False, False]
    assert teacher[target[:2], state[:2]].nonzero()[:, 1].tolist() == [forward, forward]
    earned = COLLISION_AWARE.table(world.moves())
    there = earned[1, 4, forward]
    assert teacher.value(target[:2], state[:2]).tolist() == pytest.approx([earned[0, 0, forward] + 0.5 * there, there])


@pytest.mark.slow
def test_in_mind_it_goes_only_where_steps_were_seen_to_lead(world: World):
    trainer = trainer_of(world)
    trainer.update()
    seen = trainer.observed.next_state
    teacher = Teacher(world, COLLISION_AWARE, 0.97, seen)
    mind = MindWalks(world, trainer.lookup, seen, teacher, LEARNER, torch.Generator().manual_seed(0))
    for _ in range(3):
        batch, agreement = mind.lesson()
        assert batch.better is not None and 0 < float(agreement) < 1
        here = batch.history[:, -1]
        known = teacher.has(batch.target, here)
        assert known.any() and (~known).any()
        assert (seen[here, batch.action] != UNKNOWN)[known].all()
        assert torch.equal((batch.better > 0)[known], teacher[batch.target, here][known])
        assert torch.equal((batch.better > 0)[~known], (seen[here] == UNKNOWN)[~known])
        before, after = batch.history[:, -2], batch.history[:, -1]
        assert ((seen[before] == after[:, None]).any(1) | (before == after)).all()
        assert sum(batch.rows_per_scene) == len(batch) == LEARNER.mind_walks * LEARNER.mind_steps


@pytest.mark.slow
def test_it_learns_every_target_in_a_few_hundred_frames(world: World):
    trainer = trainer_of(world)
    while not trainer.finished:
        figures = trainer.update()
    assert figures["known_ways"] > 0.9
    assert (reached_from_everywhere(trainer) > 0.9).all()


@pytest.mark.slow
def test_a_run_goes_on_bit_for_bit_and_says_what_was_adapted(scenes: list[Scene], tmp_path: Path, monkeypatch):
    request = RunRequest(scenes, TARGETS, replace(LEARNER, lessons=1), COLLISION_AWARE, seed=3)
    whole = train(request, tmp_path / "whole")
    learner = whole.read_record().learner
    assert isinstance(learner, Adapt) and learner.source == "generalist"
    assert goes_on_to_the_same_bits(request, whole, 2, lambda trainer: setattr(trainer, "generalist", None))  # no walks


def test_scenes_that_its_eyes_have_not_seen_are_refused_with_the_remedy(scenes: list[Scene], tmp_path: Path):
    bare = make_world([replace(scene, features=None, encoder=None) for scene in scenes], TARGETS)
    with pytest.raises(RunError, match="adapt learns given targets alone, not goals=seen"):
        replace(LEARNER, goals="seen").trainer(bare, COLLISION_AWARE, 0)
    with pytest.raises(RunError, match=r"the scenes have none\. Encode them.*scenes encode FILE --encoder"):
        LEARNER.trainer(bare, COLLISION_AWARE, 0)
    long = [replace(scene, cell_size_m=3.0) for scene in scenes]
    with pytest.raises(SceneError, match=r"moves of 3 m, and the generalist walks by 0\.2 to 1 m"):
        LEARNER.trainer(make_world(long, TARGETS), COLLISION_AWARE, 0)
    with pytest.raises(RunError, match="adapt learns from the scenes' own pictures alone"):
        LEARNER.check_sees_takes()
    with pytest.raises(RunError, match="adapt is trained by one worker"):
        LEARNER.check_workers(torch.tensor([20, 20]))
    others = make_world(seen_by_eyes(tmp_path / "other", *scenes, seed=1), TARGETS)
    with pytest.raises(RunError, match="have those of another encoder"):
        LEARNER.trainer(others, COLLISION_AWARE, 0)
