"""The generalist walks in the scenes that a learner is to know: a tour of each, then to every target.

It goes by what its eyes made of the pictures, and is told neither poses nor maps. What its walks show, where each
action led from each picture, is the learner's experience as if it had walked itself.

Axis letters: B steps, W walks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from clearway.agents.agent import FEATURES, Agent, State
from clearway.agents.generalist import Generalist
from clearway.learn.adapt import Adapt
from clearway.reward import COLLISION_AWARE
from clearway.world.navigation import Navigation
from clearway.world.world import World

GUIDE_SEEDS = 1 << 31  # beyond those of environments, see `seeds`


@dataclass(frozen=True)
class Walked:
    """Steps, B of them.

    Attributes:
        state, action, arrived: (B,) int64 each, in the numbering of the world.
    """

    state: Tensor
    action: Tensor
    arrived: Tensor

    def __len__(self) -> int:
        """B."""
        return len(self.state)


def guided_walks(world: World, generalist: Generalist, learner: Adapt, seed: int) -> Walked:
    """All steps of a generalist's tours of a world's scenes, and of its walks to the targets from random starts."""
    tour, most = learner.tour_steps, learner.walk_steps
    parts = []
    for scene in range(world.scene_count):
        targets = (world.target_scene == scene).nonzero()[:, 0]
        first = (seed << 32) + GUIDE_SEEDS + (scene << 16)
        seeds = torch.arange(first, first + 1 + len(targets) * learner.walks, device=world.device)
        told, state = _walk(world, generalist.explorer(tour), targets[:1], seeds[:1], tour, to_target=False)
        walked, _ = _walk(
            world, generalist.after(state), targets.repeat(learner.walks), seeds[1:], most, to_target=True
        )
        parts += [told, walked]
    return Walked(*(torch.cat([getattr(part, name) for part in parts]) for name in ("state", "action", "arrived")))


def _walk(
    world: World, agent: Agent, target: Tensor, seeds: Tensor, steps: int, *, to_target: bool
) -> tuple[Walked, State]:
    """Walks towards targets (W,), each over at its target or after so many steps, and the agent's last state."""
    assert world.features is not None, "the generalist goes by features"
    env = Navigation(world, COLLISION_AWARE, seeds, history_length=1)  # what is earned is of no interest
    env.reset(target=target)
    state = agent.reset({FEATURES: _seen(world, world.target_state[target])}, seeds.cpu().numpy())
    going = torch.ones(len(target), dtype=torch.bool, device=world.device)
    told = []
    for _ in range(steps):
        here = env.state
        decisions, state = agent.act({FEATURES: _seen(world, here)}, state)
        action = torch.from_numpy(decisions.action.astype(np.int64)).to(world.device)
        step = env.step(action)
        told.append((here[going], action[going], step.state[going]))
        going = going & ~step.reached if to_target else going
        if not going.any():
            break
    return Walked(*(torch.cat(part) for part in zip(*told, strict=True))), state


def _seen(world: World, state: Tensor) -> np.ndarray:
    assert world.features is not None
    return world.features[state].float().cpu().numpy()
