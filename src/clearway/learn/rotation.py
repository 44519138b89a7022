"""Which scenes are walked at which time: all of them, or in large sets some, in turn.

With some at a time a batch holds many rows of few scenes: fewer distinct states and targets, each of which costs the
same however many rows it has. Simulators that load one scene at a time train in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from clearway.errors import RunError
from clearway.learn.on_policy import OnPolicy
from clearway.world.world import World

ROTATION_SALT = 1_000_033


class Rotation:
    """Every cycle the scenes are dealt anew, at random, into sets of nearly the same size; each set has its updates.

    A pure function of the number of updates, so that a resumed run goes on with the same scenes.

    Args:
        scene_count: C.
        at_once: most scenes of a set; 0 for all.
        updates_each: updates that a set lasts.
        seed: of the order.
    """

    def __init__(self, scene_count: int, at_once: int, updates_each: int, seed: int) -> None:
        self.scene_count, self.updates_each, self.seed = scene_count, updates_each, seed
        self.sets = -(-scene_count // at_once) if at_once else 1

    def begins(self, update: int) -> bool:
        """Whether another set begins with the update, counted from 0."""
        return self.sets > 1 and update % self.updates_each == 0

    def scenes(self, update: int) -> Tensor:
        """Scenes of that update, ascending, int64."""
        cycle, number = divmod(update // self.updates_each, self.sets)
        if self.sets == 1:
            return torch.arange(self.scene_count)
        generator = torch.Generator().manual_seed(self.seed * ROTATION_SALT + cycle)
        order = torch.randperm(self.scene_count, generator=generator)
        return order[number * self.scene_count // self.sets : (number + 1) * self.scene_count // self.sets].sort()[0]


def divided_envs(states: Tensor, learner: OnPolicy, scenes: Tensor) -> tuple[int, ...]:
    """Environments of each scene, (C,); 0 of all but `scenes`, which share them and have one each at least.

    Args:
        states: (C,) int64, of each scene.
        learner: the settings.
        scenes: int64, ascending.

    Raises:
        RunError: too few for the number of scenes or minibatches.
    """
    _check_envs(learner, len(scenes))
    upto = (_shares(states, learner, scenes).cumsum(0) * learner.envs).round().long()
    counts = torch.diff(upto, prepend=upto.new_zeros(1))
    for scene in scenes[counts[scenes] == 0].tolist():  # rounded away
        counts[counts.argmax()] -= 1
        counts[scene] = 1
    _check_rows(learner, int(counts[scenes].min()))
    return tuple(counts.tolist())


def scene_of_envs(envs_per_scene: Sequence[int], device: torch.device) -> Tensor:
    """The scene of every environment, (N,) int64; environments are ordered by scene."""
    counts = torch.tensor(envs_per_scene, device=device)
    return torch.arange(len(counts), device=device).repeat_interleave(counts)


def check_division(states: Tensor, learner: OnPolicy, rotation: Rotation) -> None:
    """Check that environments suffice for every set that the rotation could deal: the smallest scene with the largest.

    Raises:
        RunError: they do not.
    """
    if rotation.sets == 1:
        return
    order = states.argsort(descending=True)
    most = -(-len(states) // rotation.sets)
    _check_envs(learner, most)
    least = float(_shares(states, learner, torch.cat([order[: most - 1], order[-1:]]))[order[-1]])
    _check_rows(learner, max(1, int(least * learner.envs)))  # rounded up it is more


def check_kept(world: World, envs_per_scene: Sequence[int]) -> None:
    """Raise RunError where a scene has fewer environments than targets, some of which nobody would ever walk to."""
    targets = torch.bincount(world.target_scene, minlength=world.scene_count).tolist()
    for name, envs, count in zip(world.scene_names, envs_per_scene, targets, strict=True):
        if envs < count:
            raise RunError(
                f"scene {name!r:.60}: {envs} environments for {count} targets that they keep (episode_targets). "
                "Give more environments (envs), or draw targets"
            )


def _shares(all_states: Tensor, learner: OnPolicy, scenes: Tensor) -> Tensor:
    """Share of the environments that each scene is due, (C,) float64; 0 of all but `scenes`."""
    states = torch.zeros(len(all_states), dtype=torch.float64)
    states[scenes] = all_states.double()[scenes]
    return states / states.sum() if learner.envs_by == "states" else (states > 0).double() / len(scenes)


def _check_envs(learner: OnPolicy, scenes: int) -> None:
    if learner.envs < scenes:
        other = "fewer scenes_at_once" if learner.scenes_at_once else "walk some scenes at a time (scenes_at_once)"
        raise RunError(f"{learner.envs} environments for {scenes} scenes. Give more environments (envs), or {other}")


def _check_rows(learner: OnPolicy, envs: int) -> None:
    """Check that a scene with so many environments has rows for every minibatch."""
    if envs * learner.rollout_steps < learner.minibatches:
        raise RunError(
            f"{learner.minibatches} minibatches of {envs * learner.rollout_steps} rows of a scene. "
            "Give fewer minibatches, or more environments"
        )
