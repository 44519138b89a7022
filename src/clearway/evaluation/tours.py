"""Tours: an explorer walks in a scene before the episodes, and an agent keeps what it has found."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from clearway.agents.agent import Agent, State
from clearway.errors import SceneError
from clearway.evaluation.sight import Sight
from clearway.evaluation.takes import Takes
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Scene
from clearway.world.navigation import Navigation
from clearway.world.world import World

TOUR_STREAM = 15
MOVES = [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]


@dataclass(frozen=True)
class Touring:
    """How an agent is made by a tour.

    Attributes:
        explorer: who walks the tour; called with its steps.
        after: makes the agent, by the explorer's state at the end of a tour.
        steps: of the tour.
    """

    explorer: Callable[[int], Agent]
    after: Callable[[State], Agent]
    steps: int


@dataclass(frozen=True)
class Tour:
    """What a tour came to.

    Attributes:
        state: the explorer's at the end.
        start: state of the scene in which it began, and around which the map lies.
        collisions: blocked moves.
        poses: share of the poses of the scene's largest part that it came to.
    """

    state: State
    start: int
    collisions: int
    poses: float


def walk_tour(world: World, touring: Touring, scene: Scene, seed: int, takes: Takes | None = None) -> Tour:
    """Walk a tour of a scene, from a start drawn by the seed.

    Args:
        world: of this scene alone.
        touring: who walks, and how far.
        scene: with what the explorer sees.
        seed: of the start and of all chances.
        takes: what is seen instead of the scene's own pictures.

    Raises:
        SceneError: there is nowhere to go in the scene.
        AgentError: the explorer sees what is not there.
    """
    explorer = touring.explorer(touring.steps)
    sight = Sight(world, explorer, [scene], takes)
    start, own = tour_begin(scene, seed)
    seeds = torch.tensor([own])
    env = Navigation(world, COLLISION_AWARE, seeds, history_length=1)
    env.reset(target=torch.zeros(1, dtype=torch.int64), start=torch.tensor([start]))
    state = explorer.reset({}, seeds.numpy())
    collisions, been = 0, set()
    for step in range(touring.steps):
        been.add(int(env.state))
        seen = sight.on_the_way(env.state, seeds, torch.tensor([step]))
        decisions, state = explorer.act(seen, state)
        happened = env.step(torch.from_numpy(decisions.action.astype(np.int64)))
        collisions += int(happened.blocked)
    been.add(int(env.state))
    largest = set(np.flatnonzero(scene.components == 0).tolist())
    return Tour(state, start, collisions, len(been & largest) / len(largest))


def tour_begin(scene: Scene, seed: int) -> tuple[int, int]:
    """The state in which a tour of a scene begins, drawn among those of its largest part, and the seed of its chances.

    Raises:
        SceneError: no move leads anywhere there.
    """
    largest = np.flatnonzero(scene.components == 0)
    if (scene.graph[largest][:, MOVES] == BLOCKED).all():
        problem = "every move is blocked in its largest part, so that a tour would see one cell"
        raise SceneError(scene.name, problem, "Leave the tour out, or check the scene: clearway scenes inspect")
    name = zlib.crc32(scene.name.encode())
    start = int(np.random.default_rng([seed, TOUR_STREAM, name]).choice(largest))
    return start, name + (seed << 32) + TOUR_STREAM
