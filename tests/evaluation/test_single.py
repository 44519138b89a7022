"""One episode of an agent, walked and seen again."""

from __future__ import annotations

import numpy as np

from clearway.agents.agent import LAST_ACTION, POSE, Decisions, Observation, State
from clearway.evaluation.episodes import Trajectory
from clearway.evaluation.single import memories
from clearway.world.world import make_world
from helpers.made import corridor_scene


class Remembers:
    """It would always move forward, and writes down what it holds to have done last."""

    sees = (POSE,)

    def __init__(self) -> None:
        self.held: list[int] = []

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        return {LAST_ACTION: np.full(len(seed), -1)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        self.held += state[LAST_ACTION].tolist()
        action = np.zeros(len(observation[POSE]), np.int64)
        return Decisions(action), {LAST_ACTION: action}


def test_who_sees_an_episode_again_remembers_what_was_done_in_it():
    world, agent = make_world([corridor_scene(5)], {"corridor": [8]}), Remembers()
    walk = Trajectory(np.array([0, 1, 2, 3]), np.array([1, 1, 2]))
    assert len(list(memories(world, agent, walk))) == 4
    assert agent.held == [-1, 1, 1, 2]
