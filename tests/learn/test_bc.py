"""Behaviour cloning: its loss by hand, its step by autograd, and that it learns the shortest paths."""

import copy
import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from clearway.agents.by_pose import shortest_paths
from clearway.errors import RunError
from clearway.learn import bc
from clearway.learn.bc import BC, Cloning, cloning_loss
from clearway.learn.checkpoint import newest_checkpoint, read_network
from clearway.learn.load import load_network, run_world
from clearway.learn.train import train
from clearway.reward import COLLISION_AWARE
from helpers.agents import told_after
from helpers.small_runs import (
    corridor_world,
    equal_bits,
    reached_from_everywhere,
    small_learner,
    small_request,
    small_scenes,
    small_world,
)

SMALL = small_learner(BC())
RECIPE = BC(frames=60_000, envs=60, step_limit=60, width=32, lr_start=3e-3, lr_end=1e-4)


def test_the_loss_is_the_cross_entropy_to_the_set_of_right_actions() -> None:
    scores = torch.tensor([[0.1, 0.2, 0.3, 0.4], [0.25, 0.25, 0.25, 0.25], [0.7, 0.1, 0.1, 0.1]]).log()
    output = torch.cat([scores, torch.tensor([[3.0], [4.0], [5.0]])], 1)
    right = torch.tensor([[True, False, False, True], [False, True, False, False], [False] * 4])
    loss, agreement, gradient = cloning_loss(output, right)
    assert loss.item() == pytest.approx(-(math.log(0.5) + math.log(0.25)) / 2)
    assert agreement.item() == pytest.approx((0.5 + 0.25) / 2)
    # d/dx of -log(sum of right): pi - pi / (sum of right) on right ones, pi on others, over two rows
    first, second = [0.1 - 0.2, 0.2, 0.3, 0.4 - 0.8], [0.25, 0.25 - 1, 0.25, 0.25]
    expected = torch.tensor([[*first, 0.0], [*second, 0.0], [0.0] * 5]) / 2
    torch.testing.assert_close(gradient, expected)


def test_nothing_to_be_told_is_no_loss() -> None:
    loss, agreement, gradient = cloning_loss(torch.ones(3, 5), torch.zeros(3, 4, dtype=torch.bool))
    assert (loss.item(), agreement.item(), gradient.abs().sum().item()) == (0, 0, 0)


def test_an_update_equals_the_naive_one() -> None:
    """The naive network, autograd and Adam, on what another trainer of the same seed saw."""
    world, learner = small_world(), replace(SMALL, epochs=1, lr_start=1e-2, clip_norm=0.05)
    trainer, twin = Cloning(world, learner, COLLISION_AWARE, 2), Cloning(world, learner, COLLISION_AWARE, 2)
    rollout = twin.collector.collect()
    naive = copy.deepcopy(twin.network)
    history, target = rollout.history.flatten(0, 1), rollout.target.flatten()
    states = twin.feature_map(world.features)
    scores, _ = naive(states[history], states[world.target_state][target], world.target_scene[target])
    right = told_after(shortest_paths(world), world, history, target) > 0
    assert right.any(1).all()
    loss = -(torch.softmax(scores, 1) * right).sum(1).log().mean()
    naive.zero_grad()
    loss.backward()
    norm = torch.nn.utils.clip_grad_norm_(naive.parameters(), learner.clip_norm)
    torch.optim.Adam(naive.parameters(), lr=learner.lr_start).step()
    figures = trainer.update()
    assert figures["loss"] == pytest.approx(loss.item(), rel=1e-5)
    assert figures["gradient_norm"] == pytest.approx(norm.item(), rel=1e-4)
    assert figures["gradient_norm"] > learner.clip_norm
    start = dict(twin.network.named_parameters())
    for name, parameter in trainer.network.named_parameters():
        moved, expected = parameter - start[name], naive.get_parameter(name) - start[name]
        assert (moved - expected).abs().max() < 0.02 * learner.lr_start, name
    assert (trainer.network.siamese_weight - start["siamese_weight"]).abs().max() > 0.5 * learner.lr_start


@pytest.mark.slow
def test_it_learns_the_shortest_paths() -> None:
    trainer = RECIPE.trainer(small_world(), COLLISION_AWARE, 0)
    first = trainer.update()
    while not trainer.finished:
        last = trainer.update()
    assert first["agreement"] < 0.5 < 0.9 < last["agreement"]
    assert reached_from_everywhere(trainer).min() > 0.94


def test_every_pass_learns_from_the_whole_rollout() -> None:
    once, twice = (replace(SMALL, epochs=epochs).trainer(small_world(), COLLISION_AWARE, 0) for epochs in (1, 2))
    first, both = once.update(), twice.update()
    assert both["loss"] < first["loss"]  # the mean of it and of the next, on the same rows
    assert (once.frames, once.updates) == (twice.frames, twice.updates) == (80, 1)


@pytest.mark.slow
def test_told_the_wrong_actions_it_does_not_arrive(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = bc.shortest_path_actions
    monkeypatch.setattr(bc, "shortest_path_actions", lambda *arguments: ~whole(*arguments))
    trainer = replace(RECIPE, frames=20_000).trainer(small_world(), COLLISION_AWARE, 0)
    while not trainer.finished:
        trainer.update()
    assert reached_from_everywhere(trainer).min() < 0.5


def test_a_run_is_loaded_as_any_network_and_a_seed_and_tensors_repeat_it(tmp_path: Path) -> None:
    request = small_request(learner=SMALL)
    whole = train(request, tmp_path / "whole")
    assert whole.read_record().learner == SMALL
    rows = whole.metrics()
    assert len(rows) == 10
    assert set(rows[0]) >= {"episodes", "success", "loss", "agreement", "gradient_norm", "lr"}
    assert not set(rows[0]) & {"policy_loss", "value_loss", "clipped", "explained_variance"}
    first, second = request.trainer(), request.trainer()
    for _ in range(4):
        first.update()
    second.load_tensors({name: tensor.clone() for name, tensor in first.tensors().items()}, first.frames, first.updates)
    while not second.finished:
        second.update()
    saved = read_network(newest_checkpoint(whole.checkpoints))
    assert equal_bits(
        saved, {name: tensor for name, tensor in second.tensors().items() if name in saved} | second.fixed_tensors()
    )
    agent = load_network(whole.path)
    world = run_world(agent.record, small_scenes())
    found = told_after(agent.on_poses(world), world, world.start_state[:5, None], torch.zeros(5, dtype=torch.int64))
    torch.testing.assert_close(found.sum(1), torch.ones(5))


def test_too_few_environments_are_refused() -> None:
    with pytest.raises(RunError, match="1 environments for 2 scenes"):
        replace(SMALL, envs=1).trainer(small_world(), COLLISION_AWARE, 0)
    assert Cloning(corridor_world(), replace(SMALL, envs=1), COLLISION_AWARE, 0).update()["loss"] > 0
