"""It learns: a small room is solved in seconds, and a learner broken on purpose does not pass the same check."""

from dataclasses import replace
from typing import Any

import pytest
import torch
from torch import Tensor

from clearway.envs.navigation import Navigation
from clearway.learn import trainer as trainer_module
from clearway.learn.losses import Batch, LossSettings, loss_gradient
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT
from clearway.learn.rollout import sample_actions
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from small_runs import small_world

RECIPE = replace(DEFAULT, frames=60_000, envs=60, rollout_steps=20, step_limit=60, width=32, lr_start=3e-3, lr_end=1e-4)


@torch.no_grad()
def reached_from_everywhere(trainer: Trainer) -> Tensor:
    """(M,) share of all starts from which the sampled policy reaches each target in 4x the shortest path plus 4."""
    world = trainer.world
    trainer.lookup.refresh()
    target = torch.repeat_interleave(torch.arange(world.target_count), world.start_count)  # ordered by scene
    episodes = Navigation(world, COLLISION_AWARE, torch.arange(len(target)))
    episodes.reset(target=target, start=world.start_state)
    limit = 4 * world.start_steps + 4
    rows = torch.bincount(world.target_scene[target], minlength=world.scene_count).tolist()
    reached = torch.zeros(len(target), dtype=torch.bool)
    draws = torch.Generator().manual_seed(0)
    for step in range(1, int(limit.max()) + 1):
        scores = trainer.lookup.forward(episodes.history, target, rows).scores
        done = episodes.step(sample_actions(scores, torch.rand(len(target), generator=draws).double()))
        reached |= done.reached & (step <= limit)
    share = torch.zeros(world.target_count).index_add_(0, target, reached.float())
    return share / world.start_count


def trained(learner: OnPolicy) -> Trainer:
    trainer = Trainer(small_world(), learner, COLLISION_AWARE, seed=0)
    while not trainer.finished:
        trainer.update()
    return trainer


def flipped(output: Tensor, batch: Batch, settings: LossSettings) -> Any:
    """The loss with every advantage's sign turned round."""
    return loss_gradient(output, replace(batch, advantage=-batch.advantage), settings)


def solves_everything(learner: OnPolicy) -> bool:
    """After training nearly all episodes reach their target without great detours."""
    return bool(reached_from_everywhere(trained(learner)).min() > 0.94)


def test_the_recipe_solves_a_small_world() -> None:
    assert solves_everything(RECIPE)


def test_with_the_advantage_s_sign_turned_round_it_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trainer_module, "loss_gradient", flipped)
    assert not solves_everything(RECIPE)


def test_it_solves_a_small_world_one_scene_at_a_time() -> None:
    assert solves_everything(replace(RECIPE, frames=120_000, scenes_at_once=1, scene_updates=2))
