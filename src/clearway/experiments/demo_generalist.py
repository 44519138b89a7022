"""What the demo shows before anything is trained: the generalist in a room that it has never entered."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from clearway.agents.generalist import Generalist
from clearway.evaluation.episodes import Trajectory
from clearway.evaluation.single import episode_in, memories
from clearway.generation.cached import room_of_seed
from clearway.mapping.held import Held, Laid
from clearway.scenes.scene import Scene

STEP_LIMIT = 500


@dataclass(frozen=True)
class FirstWalk:
    """An episode in a room never entered.

    Attributes:
        scene: the room.
        seed: that it was made from.
        target: the target's state.
        walk: states in the scene's own numbering, and actions.
        shortest_path_steps: from the start to the target.
        held: what the agent held at the end.
    """

    scene: Scene
    seed: int
    target: int
    walk: Trajectory
    shortest_path_steps: int
    held: Held

    @property
    def reached(self) -> bool:
        """Whether it came to the target."""
        return int(self.walk.states[-1]) == self.target

    @property
    def collisions(self) -> int:
        """Blocked moves."""
        return int((self.walk.states[1:] == self.walk.states[:-1]).sum())


def first_walk(room_seed: int, seed: int) -> FirstWalk:
    """Walk in the room of a seed, to the farthest from its start of some goals drawn by another.

    Raises:
        ClearwayError: the room's seed is out of range, or rendering is not possible here.
    """
    generalist = Generalist.shipped()
    (scene,) = generalist.seen([room_of_seed(room_seed)])
    world, walk = episode_in(scene, generalist.on_poses, None, step_limit=STEP_LIMIT, seed=seed)
    agent, laid = generalist.on_poses(world), Laid.around(scene, int(walk.states[0]))
    *_, (_, last) = memories(world, agent, walk)
    way = int(world.distance_table()[torch.tensor(0), torch.from_numpy(walk.states[:1])])
    return FirstWalk(scene, room_seed, world.scene_state(0), walk, way, agent.holds(last, laid))
