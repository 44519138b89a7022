"""One episode of an agent, walked and seen again."""

from __future__ import annotations

import numpy as np

from clearway.evaluation.episodes import Trajectory
from clearway.evaluation.single import memories
from clearway.world.world import make_world
from helpers.agents import Remembers
from helpers.made import corridor_scene


def test_who_sees_an_episode_again_remembers_what_was_done_in_it():
    world, agent = make_world([corridor_scene(5)], {"corridor": [8]}), Remembers()
    walk = Trajectory(np.array([0, 1, 2, 3]), np.array([1, 1, 2]))
    assert len(list(memories(world, agent, walk))) == 4
    assert agent.held == [-1, 1, 1, 2]
