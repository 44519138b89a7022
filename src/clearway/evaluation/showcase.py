"""One episode that several agents walk from the same start, for maps and contact sheets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.agents.agent import Agent
from clearway.evaluation.episodes import Trajectory, run_episodes
from clearway.scenes.scene import Scene
from clearway.world.world import World

EPISODES = 20  # a target, to choose from
STEP_LIMIT = 500


@dataclass(frozen=True)
class Showcase:
    """An episode in one scene, states in the scene's own numbering.

    Attributes:
        scene: its name.
        target: the target's state.
        shortest_path_steps: from the start to the target.
        walks: by the agent's name.
    """

    scene: str
    target: int
    shortest_path_steps: int
    walks: Mapping[str, Trajectory]


def showcases(
    world: World, agents: Mapping[str, Agent], scenes: Sequence[Scene] = (), *, seed: int = 0
) -> list[Showcase]:
    """For each scene the episode with the longest way among those that most of the agents finish.

    Args:
        world: scenes and targets.
        agents: by name; actions are sampled.
        scenes: the world's, in its order, for agents that see pictures.
        seed: of starts and actions.
    """
    tables = {
        name: run_episodes(
            world,
            agent,
            scenes=scenes,
            episodes_per_target=EPISODES,
            step_limit=STEP_LIMIT,
            seed=seed,
            record=True,
        )
        for name, agent in agents.items()
    }
    any_table = next(iter(tables.values()))
    finished = np.sum([table.reached for table in tables.values()], 0)
    scene_of_episode = world.target_scene.numpy()[any_table.target]
    found = []
    for scene, name in enumerate(world.scene_names):
        episodes = np.flatnonzero(scene_of_episode == scene)
        ranked = np.lexsort((-any_table.shortest_path_steps[episodes], -finished[episodes]))
        episode = int(episodes[ranked[0]])
        first = int(world.scene_offset[scene])
        walks = {
            agent: Trajectory(table.trajectories[episode].states - first, table.trajectories[episode].actions)
            for agent, table in tables.items()
            if table.trajectories is not None
        }
        target = world.scene_state(int(any_table.target[episode]))
        found.append(Showcase(name, target, int(any_table.shortest_path_steps[episode]), walks))
    return found
