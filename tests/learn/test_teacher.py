from __future__ import annotations

import numpy as np
import pytest
import torch

from clearway.errors import RunError
from clearway.evaluation.oracle import make_task, optimal_policy
from clearway.learn.teacher import Teacher
from clearway.reward import reward_named
from clearway.scenes.actions import Action
from clearway.world.world import make_world
from helpers.made import corridor_scene, grid_scene

DISCOUNT = 0.99


@pytest.mark.parametrize("reward", ["collision-aware", "shortest", "bump"])
def test_the_teacher_does_what_the_oracle_finds_best(reward: str):
    scenes = [grid_scene(1, name="one"), corridor_scene(4, feature_count=32, name="two"), grid_scene(2, name="three")]
    targets = {"one": [0, 17], "two": [9], "three": [3]}
    world = make_world(scenes, targets)
    teacher = Teacher(world, reward_named(reward), DISCOUNT)
    for target in range(world.target_count):
        number = int(world.target_scene[target])
        first, last = world.scene_offset[number : number + 2].tolist()
        task = make_task(
            world.graph(number),
            world.zone[first:last].numpy(),
            world.scene_state(target),
            reward_named(reward),
            world.clearance_m[first:last].numpy(),
        )
        states = torch.arange(first, last)
        best = teacher[torch.full_like(states, target), states].numpy()
        expected = optimal_policy(task, DISCOUNT) > 0
        others = np.arange(last - first) != task.target
        np.testing.assert_array_equal(best[others], expected[others])


def test_in_a_corridor_it_goes_straight_on():
    world = make_world([corridor_scene(5)], {"corridor": [16]})
    teacher = Teacher(world, reward_named("shortest"), DISCOUNT)
    target, states = torch.zeros(3, dtype=torch.int64), torch.tensor([0, 4, 12])
    best = teacher[target, states]
    assert best[:, Action.MOVE_FORWARD].all() and best.sum() == 3


def test_values_that_do_not_settle_are_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("clearway.learn.teacher.MOST_SWEEPS", 5)
    with pytest.raises(RunError, match="not settled after 5 sweeps"):
        Teacher(make_world([corridor_scene(9)], {"corridor": [32]}), reward_named("shortest"), 0.999)
