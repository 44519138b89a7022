"""The controls of the paper's reward."""

from pathlib import Path

import numpy as np
import pytest

from clearway.evaluation import optimum
from clearway.experiments.zones_or_step import DEARER, SHUFFLED, mean_cost, rewards
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.scenes.actions import Action
from helpers.small_setting import small_setting


def test_a_dearer_step_costs_what_zones_cost_a_random_walk(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    world = setting.world()
    rng, here, earned = np.random.default_rng(0), np.unique(world.start_state.numpy()), 0.0
    scene = np.searchsorted(world.scene_offset.numpy(), here, side="right")
    table, steps = COLLISION_AWARE.table(world.moves())[0], 400
    for _ in range(steps):
        action = rng.integers(4, size=len(here))
        own = table[here, action]
        earned += float(np.mean([own[scene == each].mean() for each in np.unique(scene)])) / steps
        here = world.next_state.numpy()[here, action]
    assert abs(mean_cost(setting) - earned) < 2e-4
    assert COLLISION_AWARE.parameters["beta"] < mean_cost(setting) < SHORTEST.parameters["alpha"]


def test_shuffled_zones_are_as_many_in_other_places(tmp_path: Path) -> None:
    setting = small_setting(tmp_path)
    by_name = {reward.name: reward for reward in rewards(setting)}
    moves = setting.world().moves()
    left = Action.TURN_LEFT  # leads to every pose once
    ours, theirs = (by_name[name].table(moves)[0][:, left] for name in (COLLISION_AWARE.name, SHUFFLED))
    assert sorted(ours) == sorted(theirs)
    assert (ours != theirs).any()
    dearer = by_name[DEARER].table(moves)[0]
    assert np.unique(dearer).tolist() == [mean_cost(setting)]


def test_exact_policies_are_of_the_zones_that_training_pays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world, tables, whole = small_setting(tmp_path).world(), [], optimum.task_of
    (shuffled,) = (reward for reward in rewards(small_setting(tmp_path)) if reward.name == SHUFFLED)
    monkeypatch.setattr(optimum, "task_of", lambda *words: (tables.append(words[-1]), whole(*words))[1])
    optimum.world_yardsticks(world, shuffled)
    paid = shuffled.table(world.moves())
    assert world.scene_count > 1 and len(tables) == world.target_count
    for scene, table in zip(world.target_scene.tolist(), tables, strict=True):
        first, last = world.scene_offset[scene : scene + 2].tolist()
        np.testing.assert_array_equal(table, paid[:, first:last])
