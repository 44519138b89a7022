"""Own goals on a corridor of five cells (states 4 * cell + heading / 90) and a small grid."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from clearway.agents.by_pose import network_on_poses
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.metrics import METRIC_NAMES, by_target
from clearway.learn import running, train
from clearway.learn.a2c import A2C
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_training
from clearway.learn.hindsight import find_segments
from clearway.learn.on_policy import OnPolicy
from clearway.learn.own_goals import OWN_SHARE, OwnGoals, goal_world
from clearway.learn.presets import DEFAULT
from clearway.learn.rollout import Rollout
from clearway.learn.trainer import Trainer
from clearway.model.feature_map import prepared_features
from clearway.model.lookup import LookupNetwork
from clearway.reward import COLLISION_AWARE
from clearway.scenes.floor_plans import GENERATED
from clearway.world.navigation import TargetChoice
from clearway.world.world import World, make_world
from helpers.made import grid_scene
from helpers.small_runs import (
    CORRIDOR_TARGETS,
    FEATURES,
    corridor_world,
    equal_bits,
    small_learner,
    small_request,
    small_trainer,
    small_world,
)

SEEN = small_learner(goals="seen")


def seen_states(world: World, goals: OwnGoals) -> set[int]:
    """States that are own goals."""
    return set(world.target_state[goals.known & ~goals.given].tolist())


def rows_told(trainer: Trainer, rollout: Rollout, told: Tensor | None) -> set[tuple[int, int, int, bool]]:
    """(environment, step, goal told, arrives) of the rows that hindsight finds."""
    rows = find_segments(rollout, trainer.navigation, told)
    columns = rows.env.tolist(), rows.step.tolist(), rows.target.tolist(), rows.hit.tolist()
    return set(zip(*columns, strict=True))


def test_every_pose_may_become_a_goal_and_the_given_ones_come_first() -> None:
    world = goal_world(small_world())
    first, last = world.scene_offset.tolist()[:2]
    states = world.target_state[world.target_scene == 0].tolist()
    assert tuple(states[: len(CORRIDOR_TARGETS)]) == CORRIDOR_TARGETS
    assert sorted(states) == list(range(first, last))
    assert world.target_count == world.state_count
    assert (world.target_scene.diff() >= 0).all()


def test_held_out_poses_of_a_generated_room_are_no_goals() -> None:
    made = grid_scene(1, width=6, depth=5, feature_count=FEATURES)
    scene = replace(made, made_by=replace(made.made_by, source=GENERATED))
    held = scene.held_out
    assert 0 < held.sum() < len(held)
    target = int(np.flatnonzero(~held & (scene.components == 0))[0])
    goals = goal_world(make_world([scene], {scene.name: [target]})).target_state.numpy()
    assert not held[goals].any()
    assert len(goals) == np.count_nonzero(~held & (scene.components == 0))


def test_a_pose_is_drawn_only_once_it_was_seen_and_half_of_the_episodes_then_go_to_such() -> None:
    world = goal_world(corridor_world())
    goals = OwnGoals(world, corridor_world().target_state)
    choice, even = TargetChoice.by_scene(world, torch.zeros(1, dtype=torch.int64)), torch.ones(world.target_count)

    def drawn() -> Tensor:
        choice.reweigh(goals.weights(choice, even.double()))
        shares = torch.zeros(world.state_count, dtype=torch.float64)
        return shares.index_add_(
            0, world.target_state[choice.members[0]], choice.bounds[0].diff(prepend=torch.zeros(1))
        )

    assert goals.count == 0
    assert drawn()[list(CORRIDOR_TARGETS)].tolist() == pytest.approx([1 / 3] * 3)
    goals.see(torch.tensor([[3, 8], [3, 17]]))  # 8 is a given target
    assert (goals.count, seen_states(world, goals)) == (2, {3, 17})
    assert drawn()[[3, 17]].tolist() == pytest.approx([OWN_SHARE / 2] * 2)
    assert drawn()[list(CORRIDOR_TARGETS)].tolist() == pytest.approx([(1 - OWN_SHARE) / 3] * 3)
    assert drawn().sum() == pytest.approx(1)


def test_padding_of_a_small_scene_is_never_drawn() -> None:
    world = goal_world(small_world())
    goals = OwnGoals(world, small_world().target_state)
    choice = TargetChoice.by_scene(world, torch.zeros(1, dtype=torch.int64))
    goals.see(world.target_state)
    weights = goals.weights(choice, torch.ones(world.target_count, dtype=torch.float64))
    counts = torch.bincount(world.target_scene)
    assert counts[0] != counts[1]
    assert (weights > 0).sum(1).tolist() == counts.tolist()


def test_a_training_sets_itself_the_poses_it_has_been_in_and_no_others(monkeypatch: pytest.MonkeyPatch) -> None:
    trainer = small_trainer(SEEN)
    goals, world = trainer.own_goals, trainer.navigation.world
    stood: set[int] = set()
    drawn: set[int] = set()
    assert goals is not None
    collect = trainer.collector.collect

    def watched(steps: int) -> Rollout:
        could_know = set(stood)
        rollout = collect(steps)
        begun = world.target_state[rollout.target.unique()].tolist()
        assert set(begun) <= could_know | set(trainer.world.target_state.tolist())
        drawn.update(begun)
        stood.update(torch.stack([rollout.history[:, :, -1], rollout.arrived]).flatten().tolist())
        return rollout

    monkeypatch.setattr(trainer.collector, "collect", watched)
    for update in range(1, 6):
        figures = trainer.update()
        given = set(trainer.world.target_state.tolist())
        assert seen_states(world, goals) == stood - given, update
        assert figures["own_goals"] == len(stood - given)
    assert drawn - given


def test_hindsight_tells_of_given_goals_and_of_some_own_ones_drawn_anew() -> None:
    trainer = small_trainer(SEEN)
    for _ in range(3):
        trainer.update()
    goals, rollout = trainer.own_goals, trainer.collector.collect()
    assert goals is not None
    everything = rows_told(trainer, rollout, goals.known)
    assert everything == rows_told(trainer, rollout, None)
    chosen = goals.told(0, 5)
    assert torch.equal(chosen, goals.told(0, 5))
    assert not torch.equal(chosen, goals.told(0, 6))
    assert (chosen & goals.given).sum() == goals.given.sum()
    assert 0 < (chosen & ~goals.given).sum() < goals.count
    some = rows_told(trainer, rollout, chosen)
    assert some == {row for row in everything if chosen[row[2]]}
    assert {False, True} == {bool(goals.given[row[2]]) for row in some}


def test_figures_are_those_of_the_given_targets() -> None:
    trainer = small_trainer(SEEN)
    for _ in range(8):
        trainer.update()
    statistics, goals = trainer.statistics, trainer.own_goals
    assert goals is not None
    assert statistics.target_count == trainer.world.target_count == 5
    assert statistics.totals[~goals.given].sum() > 0
    expected = statistics.totals[goals.given].clone()
    assert torch.equal(statistics.take(), expected)
    assert statistics.totals.sum() == 0
    statistics.recent_success.fill_(1)
    assert statistics.solved == 5


@pytest.mark.slow
@pytest.mark.parametrize("learner", [SEEN, small_learner(A2C(), goals="seen"), replace(SEEN, balance=3.0)])
def test_it_goes_on_to_the_same_bits(learner: OnPolicy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    request = small_request(learner=learner)
    whole = train.train(request, tmp_path / "whole")
    update = Trainer.update

    def interrupted(trainer: Trainer) -> dict[str, float]:
        if trainer.updates == 4:
            raise KeyboardInterrupt
        figures = update(trainer)
        running.save(trainer, train.RunFolder(tmp_path / "parts"), 0.0)
        return figures

    monkeypatch.setattr(Trainer, "update", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train.train(request, tmp_path / "parts")
    monkeypatch.setattr(Trainer, "update", update)
    parts = train.train(request, tmp_path / "parts", resume=True)
    ends = [newest_checkpoint(folder.checkpoints) for folder in (whole, parts)]
    assert equal_bits(*(read_network(end) for end in ends))
    assert equal_bits(*(read_training(end) for end in ends))


def test_scenes_in_turn_draw_goals_of_their_own() -> None:
    trainer = small_trainer(replace(SEEN, scenes_at_once=1, scene_updates=1))
    for _ in range(6):
        trainer.update()  # begins staggered again after other poses were seen
    world, nav = trainer.navigation.world, trainer.navigation
    assert torch.equal(world.target_scene[nav.target], nav.choice.groups)
    assert trainer.own_goals is not None
    assert trainer.own_goals.known[nav.target].all()


def test_a_run_without_own_goals_is_recorded_as_ever_and_reads_runs_that_did_not_know_them(tmp_path: Path) -> None:
    folder = train.train(small_request(learner=small_learner(frames=80)), tmp_path / "run")
    tensors = read_training(newest_checkpoint(folder.checkpoints))
    assert not [name for name in tensors if name.startswith("own_goals") or "told" in name]
    content = json.loads((folder.path / "run.json").read_text())
    assert content["learner"].pop("goals") == "given"
    (folder.path / "run.json").write_text(json.dumps(content))
    assert folder.read_record().learner == small_learner(frames=80)
    assert asdict(DEFAULT)["goals"] == "given"


@pytest.mark.slow
def test_it_learns_to_reach_poses_that_were_never_given() -> None:
    """Share of starts from which poses never given are reached; without own goals next to none are reliably."""
    learner = small_learner(frames=24_000, envs=40, rollout_steps=10, width=64, lr_start=2e-3, lr_end=2e-4)
    shares = {}
    for goals in ("given", "seen"):
        trainer = Trainer(corridor_world(), replace(learner, goals=goals), COLLISION_AWARE, 0)
        while not trainer.finished:
            trainer.update()
        shares[goals] = _reached_never_given(trainer)
    assert shares["seen"] > 0.95 > 0.7 > shares["given"], shares


@torch.no_grad()
def _reached_never_given(trainer: Trainer) -> float:
    never = [state for state in range(trainer.world.state_count) if state not in CORRIDOR_TARGETS]
    world = trainer.world.with_targets({"corridor": never})
    lookup = LookupNetwork(trainer.network, prepared_features(world, trainer.feature_map), world.target_state)
    agent = network_on_poses(lookup, world, trainer.learner.reward_scale)
    table = run_episodes(world, agent, episodes_per_target=20, step_limit=100, seed=1)
    return float(by_target(table, world.target_count)[:, METRIC_NAMES.index("sc_4x")].mean())
