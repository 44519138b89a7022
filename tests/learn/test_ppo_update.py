"""The default update, several minibatches a pass, against the same written plainly: naive network, autograd, Adam."""

import copy
from typing import Literal

import pytest
import torch
from torch import Tensor, nn
from torch.optim import Adam

from clearway.learn.losses import Batch, LossSettings, actor_critic_loss
from clearway.learn.minibatches import Minibatch, dealt_epochs
from clearway.learn.trainer import SHUFFLE_SALT, Trainer
from clearway.model.network import SiameseActorCritic
from helpers.small_runs import small_learner, small_trainer


def gathered_epochs(trainer: Trainer) -> list[list[Minibatch]]:
    """What the trainer's first update will learn from; uses up the rollout."""
    learner = trainer.learner
    rollout = trainer.collector.collect()
    batch, _ = trainer._batch(rollout, looks_ahead=True)
    if learner.hindsight:
        batch = trainer._with_hindsight(rollout, batch)
    epochs = dealt_epochs(
        batch,
        trainer.world.state_count,
        trainer.world.target_count,
        epochs=learner.epochs,
        parts=learner.minibatches,
        row_step=1,
        generator=torch.Generator().manual_seed(trainer.seed * SHUFFLE_SALT),
    )
    return list(epochs)


def loss_of(network: SiameseActorCritic, rows: Batch, trainer: Trainer) -> Tensor:
    world, states = trainer.world, trainer.feature_map(trainer.world.features)
    goal = states[world.target_state[rows.target]]
    scores, value = network(states[rows.history], goal, world.target_scene[rows.target])
    output = torch.cat([scores, value[:, None]], 1)
    return actor_critic_loss(output, rows, LossSettings.after(0, trainer.learner)).total


def naive_update(trainer: Trainer) -> SiameseActorCritic:
    """The network after the trainer's first update, computed afresh."""
    learner, network = trainer.learner, copy.deepcopy(trainer.network)
    siamese, *others = network.parameters()
    first_layer, rest = Adam([siamese], learner.lr_start * learner.siamese_lr), Adam(others, learner.lr_start)
    for minibatches in gathered_epochs(trainer):
        waiting: list[Tensor] = []
        for part in minibatches:
            network.zero_grad()
            loss_of(network, part.rows, trainer).backward()
            assert siamese.grad is not None
            waiting.append(siamese.grad)
            if learner.siamese_step == "minibatch" or part is minibatches[-1]:
                siamese.grad = torch.stack(waiting).mean(0)
                waiting = []
                nn.utils.clip_grad_norm_(network.parameters(), learner.clip_norm)
                first_layer.step()
            else:
                nn.utils.clip_grad_norm_(others, learner.clip_norm)
            rest.step()
    return network


@pytest.mark.parametrize("siamese_step", ["pass", "minibatch"])
@pytest.mark.parametrize("hindsight", [False, True])
def test_a_ppo_update_equals_the_naive_one(siamese_step: Literal["pass", "minibatch"], hindsight: bool) -> None:
    learner = small_learner(
        siamese_step=siamese_step,
        hindsight=hindsight,
        step_limit=200,
        lr_start=5e-3,
        ratio_clip=0.02,
        clip_norm=0.05,
        matmul_precision="highest",
    )
    trainer = small_trainer(learner, seed=2)
    before = copy.deepcopy(trainer.network)
    expected = naive_update(small_trainer(learner, seed=2))
    update = trainer.update()
    assert update["gradient_norm"] > learner.clip_norm
    assert update["clipped"] > 0
    assert (update["hindsight_rows"] > 0) == hindsight
    for (name, after), start, naive in zip(
        trainer.network.named_parameters(), before.parameters(), expected.parameters(), strict=True
    ):
        moved = (naive - start).abs().max().item()
        assert moved > 0, name
        torch.testing.assert_close(after, naive, rtol=0, atol=1e-3 * moved, msg=lambda m, n=name: f"{n}: {m}")
