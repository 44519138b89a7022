"""It learns: a small room is solved in seconds, and a learner broken on purpose does not pass the same check."""

from dataclasses import replace
from typing import Any

import pytest
from torch import Tensor

from clearway.learn import trainer as trainer_module
from clearway.learn.losses import Batch, LossSettings, loss_gradient
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from helpers.small_runs import reached_from_everywhere, small_world

RECIPE = replace(DEFAULT, frames=60_000, envs=60, rollout_steps=20, step_limit=60, width=32, lr_start=3e-3, lr_end=1e-4)


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


@pytest.mark.slow
def test_with_the_advantage_s_sign_turned_round_it_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trainer_module, "loss_gradient", flipped)
    assert not solves_everything(RECIPE)


@pytest.mark.slow
def test_it_solves_a_small_world_one_scene_at_a_time() -> None:
    assert solves_everything(replace(RECIPE, frames=120_000, scenes_at_once=1, scene_updates=2))
