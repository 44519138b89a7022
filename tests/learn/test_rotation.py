"""Some scenes at a time: every scene has its turn, batches hold its rows alone, and runs go on with the same ones."""

from dataclasses import replace

import pytest
import torch

from clearway.errors import RunError
from clearway.learn.rotation import Rotation, divided_envs
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.world.world import World, make_world
from helpers.made import corridor_scene
from helpers.small_runs import FEATURES, equal_bits, small_learner, small_trainer

CELLS = (3, 4, 5, 6, 7)
SOME = small_learner(scenes_at_once=2, scene_updates=3, heads="shared")


def corridors() -> World:
    """Five corridors of 12 to 28 states, a target in each one's first and last cell."""
    scenes = [replace(corridor_scene(n, feature_count=FEATURES), name=f"corridor {n}") for n in CELLS]
    return make_world(scenes, {scene.name: (0, scene.state_count - 4) for scene in scenes})


def states_of(world: World) -> torch.Tensor:
    """(C,) states of each scene."""
    return torch.diff(world.scene_offset)


def test_every_cycle_deals_all_scenes_out_once_in_another_order() -> None:
    rotation = Rotation(scene_count=10, at_once=4, updates_each=5, seed=0)
    cycles = [[tuple(rotation.scenes(15 * cycle + 5 * n).tolist()) for n in range(3)] for cycle in range(4)]
    for sets in cycles:
        assert sorted(len(scenes) for scenes in sets) == [3, 3, 4]
        assert sorted(scene for scenes in sets for scene in scenes) == list(range(10))
        assert all(list(scenes) == sorted(scenes) for scenes in sets)
    assert len({tuple(sets) for sets in cycles}) == 4
    assert Rotation(10, 4, 5, seed=1).scenes(0).tolist() != Rotation(10, 4, 5, seed=2).scenes(0).tolist()


def test_a_set_lasts_its_updates() -> None:
    rotation = Rotation(scene_count=6, at_once=2, updates_each=4, seed=3)
    assert [update for update in range(13) if rotation.begins(update)] == [0, 4, 8, 12]
    for update in range(12):
        assert torch.equal(rotation.scenes(update), rotation.scenes(update - update % 4))


@pytest.mark.parametrize("at_once", [0, 6, 9])
def test_all_at_once_never_change(at_once: int) -> None:
    rotation = Rotation(scene_count=6, at_once=at_once, updates_each=1, seed=3)
    assert not any(rotation.begins(update) for update in range(5))
    assert rotation.scenes(4).tolist() == list(range(6))


def test_environments_walk_the_scenes_whose_turn_it_is() -> None:
    world = corridors()
    trainer = Trainer(world, SOME, COLLISION_AWARE, 0)
    walked = set()
    for update in range(9):
        trainer.update()
        scenes = trainer.rotation.scenes(update)
        found = world.target_scene[trainer.navigation.target]
        assert found.unique().tolist() == scenes.tolist()
        assert torch.equal(found, found.sort()[0])  # ordered by scene
        assert torch.bincount(found, minlength=5).tolist() == list(trainer.collector.rows_per_scene)
        assert trainer.frames == 80 * (update + 1)
        walked |= set(scenes.tolist())
    assert walked == {0, 1, 2, 3, 4}


def test_where_a_turn_ends_open_episodes_are_forgotten() -> None:
    trainer = Trainer(corridors(), replace(SOME, step_limit=1000), COLLISION_AWARE, 0)
    seen = []
    for _ in range(4):
        trainer.update()
        seen.append(trainer.statistics.open_steps.max().item())
    assert seen[2] > 8 >= seen[3]


def test_environments_are_shared_by_the_scenes_in_proportion_to_their_states() -> None:
    learner = small_learner(envs=40)
    assert divided_envs(states_of(corridors()), learner, torch.tensor([0, 4])) == (12, 0, 0, 0, 28)
    assert divided_envs(states_of(corridors()), replace(learner, envs_by="scenes"), torch.tensor([1, 2])) == (
        0,
        20,
        20,
        0,
        0,
    )


@pytest.mark.parametrize("updates", [1, 3, 4, 7])
def test_tensors_bring_a_trainer_back_bit_for_bit(updates: int) -> None:
    trainer, resumed = (Trainer(corridors(), SOME, COLLISION_AWARE, 9) for _ in range(2))
    for _ in range(updates):
        trainer.update()
    saved = {name: tensor.clone() for name, tensor in trainer.tensors().items()}
    resumed.load_tensors(saved, trainer.frames, trainer.updates)
    for _ in range(4):
        assert trainer.update() == resumed.update()
    assert equal_bits(trainer.tensors(), resumed.tensors())


def test_as_many_as_there_are_is_the_same_as_all() -> None:
    some, all_scenes = (small_trainer(small_learner(scenes_at_once=n)) for n in (2, 0))
    for _ in range(3):
        assert some.update() == all_scenes.update()
    assert equal_bits(some.tensors(), all_scenes.tensors())


def test_fewer_environments_than_scenes_suffice() -> None:
    learner = replace(SOME, envs=4)
    with pytest.raises(RunError, match=r"2 environments for 5 scenes.*scenes_at_once"):
        Trainer(corridors(), replace(learner, envs=2, scenes_at_once=0), COLLISION_AWARE, 0)
    Trainer(corridors(), learner, COLLISION_AWARE, 0).update()


def uneven(*cells: int) -> World:
    """Corridors of so many cells, two targets each."""
    scenes = [replace(corridor_scene(n, feature_count=FEATURES), name=f"{i}") for i, n in enumerate(cells)]
    return make_world(scenes, {scene.name: (0, scene.state_count - 4) for scene in scenes})


def test_every_set_has_environments_for_each_of_its_scenes() -> None:
    """The share of the corridor of 3 cells is less than half an environment beside the two long ones."""
    world, rotation = uneven(8, 47, 3, 58, 26), Rotation(5, 4, 1, 0)
    learner = replace(SOME, envs=8, scenes_at_once=4)
    for update in range(60):
        scenes = rotation.scenes(update)
        counts = divided_envs(states_of(world), learner, scenes)
        assert sum(counts) == 8
        assert [number for number, count in enumerate(counts) if count] == scenes.tolist()
    assert divided_envs(states_of(world), learner, torch.arange(5)) == (1, 2, 1, 3, 1)


def test_minibatches_are_refused_at_the_start_where_some_set_would_have_too_few_rows() -> None:
    """The short corridor's share is two rows beside the long one, more beside others."""
    world, learner = uneven(2, 12, 12, 100), replace(SOME, envs=100, rollout_steps=1, scenes_at_once=2, minibatches=2)
    Trainer(world, replace(learner, minibatches=1), COLLISION_AWARE, 0)
    with pytest.raises(RunError, match="2 minibatches of 1 rows"):
        Trainer(world, learner, COLLISION_AWARE, 0)


def test_a_set_for_which_there_would_be_too_few_is_refused_at_the_start() -> None:
    with pytest.raises(RunError, match=r"1 environments for 2 scenes.*fewer scenes_at_once"):
        Trainer(uneven(80, *(2,) * 7), replace(SOME, envs=1), COLLISION_AWARE, 0)
