"""Small worlds, networks and training settings for the tests of the model and the learner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import torch
from torch import Tensor

from clearway.learn.bc import Cloning
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_training
from clearway.learn.learner import Learner
from clearway.learn.load import TrainedNetwork
from clearway.learn.on_policy import OnPolicy
from clearway.learn.presets import DEFAULT
from clearway.learn.rollout import sample_actions
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.running import Learning
from clearway.learn.train import RunRequest
from clearway.learn.trainer import Trainer
from clearway.model.network import NetworkShape, SiameseActorCritic
from clearway.reward import COLLISION_AWARE, Reward
from clearway.scenes.scene import Scene
from clearway.world.navigation import Navigation
from clearway.world.world import World, make_world
from helpers.made import corridor_scene, grid_scene

FEATURES = 12
CORRIDOR_TARGETS = (0, 8, 16)  # looking along the corridor, in its first, middle and last cell
GRID_TARGETS = (5, 22)


def corridor_world() -> World:
    """One corridor of five cells: states 4 * cell + heading / 90, targets 0, 8 and 16."""
    return make_world([corridor_scene(5, feature_count=FEATURES)], {"corridor": CORRIDOR_TARGETS})


def small_scenes() -> list[Scene]:
    """A corridor and a grid."""
    return [corridor_scene(5, feature_count=FEATURES), grid_scene(1, width=4, depth=3, feature_count=FEATURES)]


def small_targets() -> dict[str, tuple[int, ...]]:
    """Three targets in the corridor, two in the grid."""
    return {"corridor": CORRIDOR_TARGETS, "grid": GRID_TARGETS}


def small_world() -> World:
    """The two small scenes."""
    return make_world(small_scenes(), small_targets())


def small_network(world: World, width: int = 16, seed: int = 0) -> SiameseActorCritic:
    """A narrow network for a world."""
    assert world.features is not None
    return SiameseActorCritic(NetworkShape(world.scene_count, world.features.shape[1], width), seed)


Kind = TypeVar("Kind", bound=Learner)


def small_learner(learner: Kind = DEFAULT, **changes: Any) -> Kind:
    """Settings for 10 environments, 8 steps, 10 updates, where `changes` do not say otherwise."""
    small: dict[str, Any] = {"frames": 800, "envs": 10, "rollout_steps": 8, "step_limit": 30, "width": 16}
    return replace(learner, **({name: small[name] for name in small if hasattr(learner, name)} | changes))


def small_trainer(learner: OnPolicy, reward: Reward = COLLISION_AWARE, seed: int = 0) -> Trainer:
    """A trainer on the two small scenes."""
    return Trainer(small_world(), learner, learner.paid(reward), seed)


def small_request(**changes: Any) -> RunRequest:
    """A training run on the two small scenes."""
    request = RunRequest(small_scenes(), small_targets(), small_learner(), COLLISION_AWARE, seed=3)
    return replace(request, **changes)


def trained_network(updates: int = 4) -> TrainedNetwork:
    """What the small run has learnt after so many updates."""
    request = small_request()
    trainer = request.trainer()
    for _ in range(updates):
        trainer.update()
    return TrainedNetwork(record_of(request), trainer.network, trainer.feature_map, trainer.frames)


@torch.no_grad()
def reached_from_everywhere(trainer: Trainer | Cloning) -> Tensor:
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


def equal_bits(first: dict[str, Tensor], second: dict[str, Tensor]) -> bool:
    """The same names with the same tensors, bit for bit."""
    return first.keys() == second.keys() and all(torch.equal(first[name], second[name]) for name in first)


def goes_on_to_the_same_bits(
    request: RunRequest, whole: RunFolder, updates: int, prepare: Callable[[Learning], object] = lambda trainer: None
) -> bool:
    """A trainer that takes up what another one left after some updates ends as a finished run did.

    `prepare` changes it before it goes on.
    """
    trainer, other = request.trainer(), request.trainer()
    for _ in range(updates):
        trainer.update()
    other.load_tensors(
        {name: tensor.clone() for name, tensor in trainer.tensors().items()}, trainer.frames, trainer.updates
    )
    prepare(other)
    while not other.finished:
        other.update()
    end = newest_checkpoint(whole.checkpoints)
    saved = read_network(end) | read_training(end)
    kept = {name: tensor.cpu() for name, tensor in other.tensors().items() if name != "statistics.totals"}  # in rows
    return equal_bits({name: saved[name] for name in kept}, kept)
