from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import clearway
from clearway.agents.agent import FEATURES
from clearway.agents.by_pose import RandomWalk
from clearway.errors import RunError
from clearway.evaluation.episodes import run_episodes
from clearway.learn.load import load_agent
from clearway.learn.recurrent import Recurrent, TrainedRecurrent
from clearway.learn.recurrent_trainer import RecurrentTrainer
from clearway.learn.train import RunRequest, train
from clearway.model.recurrent import LAST_COUNT, RecurrentActorCritic, RecurrentShape, SeenPairs, last_step, likeness
from clearway.reward import COLLISION_AWARE
from clearway.scenes.aspect import AspectWarning
from clearway.scenes.scene import Scene
from clearway.world.world import World, make_world
from helpers.made import corridor_scene, grid_scene
from helpers.small_eyes import SMALL, seen_by_eyes, small_eyes

LEARNER = Recurrent(frames=16 * 8 * 6, envs=16, rollout_steps=8, step_limit=20, width=16, minibatches=2)
TARGETS = {"corridor": [0, 8, 16], "grid": [5, 22]}


@pytest.fixture
def scenes(tmp_path: Path) -> list[Scene]:
    return seen_by_eyes(tmp_path / "eyes", corridor_scene(5), grid_scene(1, width=4, depth=3))


@pytest.fixture
def world(scenes: list[Scene]) -> World:
    return make_world(scenes, TARGETS)


def trainer_of(world: World, learner: Recurrent = LEARNER, seed: int = 0) -> RecurrentTrainer:
    trainer = learner.trainer(world, COLLISION_AWARE, seed)
    assert isinstance(trainer, RecurrentTrainer)
    return trainer


@pytest.mark.slow
def test_a_training_goes_on_bit_for_bit_in_both_parts(world: World):
    whole = trainer_of(world)
    told = [whole.update() for _ in range(6)]
    assert ["agreement" in figures for figures in told] == [True] * 3 + [False] * 3
    assert whole.finished and whole.frames == LEARNER.frames
    for done in (2, 4):
        first = trainer_of(world)
        for _ in range(done):
            first.update()
        kept = {name: tensor.clone() for name, tensor in first.tensors().items()}
        second = trainer_of(world, seed=0)
        second.load_tensors(kept, first.frames, first.updates)
        assert [second.update() for _ in range(6 - done)] == told[done:]
        for name, tensor in second.tensors().items():
            assert torch.equal(tensor, whole.tensors()[name]), name


def test_a_seed_repeats_and_another_does_not(world: World):
    one, again, other = (trainer_of(world, seed=seed).update() for seed in (1, 1, 2))
    assert one == again != other


@pytest.mark.slow
def test_it_learns_what_the_planner_teaches_and_walks_better_than_by_chance(tmp_path: Path, scenes: list[Scene]):
    learner = replace(LEARNER, frames=40_000, taught=0.8, envs=40, width=48, taught_lr_start=3e-3)
    request = RunRequest(scenes, TARGETS, learner, COLLISION_AWARE)
    folder = train(request, tmp_path / "run")
    rows = folder.metrics()
    taught = [row for row in rows if "agreement" in row]
    assert taught[-1]["agreement"] > taught[0]["agreement"] + 0.15
    world = make_world(scenes, TARGETS)
    agent = load_agent(tmp_path / "run").on_poses(world)
    steps = [
        run_episodes(world, walker, episodes_per_target=40, step_limit=1000, seed=1).steps.mean()
        for walker in (agent, RandomWalk())
    ]
    assert steps[0] < 0.6 * steps[1]


def test_the_agent_says_in_an_episode_what_the_network_said_in_training(world: World):
    trainer = trainer_of(world)
    trainer.update()
    tensors = {**trainer.tensors(), **trainer.fixed_tensors()}
    agent = LEARNER.agent(None, tensors, 0).on_poses(world)  # type: ignore[arg-type]  # no run, no record
    assert world.features is not None
    target, hidden, last = torch.tensor([1, 3]), torch.zeros(2, 16), torch.zeros(2, LAST_COUNT)
    state = agent.reset({FEATURES: world.features[world.target_state[target]].numpy()}, np.array([3, 4]))
    path = [torch.tensor(poses) for poses in ([0, 30], [4, 30], [8, 34], [8, 42])]  # the first arrives
    for seen, onward in zip(path, [*path[1:], path[-1]], strict=True):
        with torch.no_grad():
            said = trainer.network(trainer.seen(target, seen), last, hidden)
        decisions, state = agent.act({FEATURES: world.features[seen].numpy()}, state)
        np.testing.assert_allclose(decisions.probabilities, torch.softmax(said.scores, 1).numpy(), atol=1e-3)
        np.testing.assert_allclose(decisions.value, said.value.numpy(), atol=2e-3)
        np.testing.assert_array_equal(decisions.arrived, said.arrived.numpy() > 0)
        hidden = said.hidden
        last = last_step(torch.from_numpy(decisions.action), trainer.seen.likeness(onward, seen))


def test_the_table_holds_what_the_eyes_compare(world: World):
    assert world.features is not None
    with_takes = world.with_takes([world.features[:20, None] * 0.5, world.features[20:, None] * 0.5])
    trainer = trainer_of(with_takes)
    target, state, take = torch.tensor([0, 2, 4, 4]), torch.tensor([3, 19, 20, 43]), torch.tensor([0, 1, 1, 0])
    seen = torch.stack([world.features[s] * (0.5 if t else 1) for s, t in zip(state, take, strict=True)])
    told = trainer.pairs(seen, world.features[world.target_state[target]])
    sighting = state * 2 + take
    torch.testing.assert_close(trainer.seen(target, sighting), told, rtol=2e-3, atol=2e-3)
    alike = trainer.seen.likeness(sighting, state * 2)
    torch.testing.assert_close(alike, torch.tensor([1.0, 0.5, 0.5, 1.0]), rtol=1e-3, atol=1e-3)
    rows = 2 * (3 * 20 + 2 * 40), 2 * (20 + 40)
    assert trainer.seen.bytes == rows[0] * 2 * trainer.pairs.count + rows[1] * 4 * 16


def test_every_step_shows_one_of_the_takes_and_of_the_scenes_own_pictures(world: World):
    assert world.features is not None
    own = trainer_of(world).navigation
    assert torch.equal(own.sighting, own.state)
    other = trainer_of(
        world.with_takes([world.features[:20, None].repeat(1, 2, 1), world.features[20:, None].repeat(1, 2, 1)])
    )
    shown = []
    for _ in range(3):
        other.update()
        shown.append(other.navigation.sighting % 3)
    counts = torch.bincount(torch.cat(shown), minlength=3)
    assert len(counts) == 3 and (counts > 5).all()


def test_the_network_says_along_an_episode_what_it_says_step_by_step():
    network = RecurrentActorCritic(RecurrentShape(5, 8), seed=1)
    pairs, last, begins = torch.randn(6, 3, 5), torch.randn(6, 3, LAST_COUNT), torch.rand(6, 3) < 0.3
    first = hidden = torch.randn(3, 8)
    said = []
    for step in range(6):
        said.append(network(pairs[step], last[step], torch.where(begins[step, :, None], 0.0, hidden)))
        hidden = said[-1].hidden
    along = network.along(pairs, last, first, begins)
    for name in ("scores", "value", "arrived", "hidden"):
        torch.testing.assert_close(getattr(along, name), torch.stack([getattr(one, name) for one in said]))


def test_a_network_that_forgets_says_the_same_whatever_went_before():
    network = RecurrentActorCritic(RecurrentShape(5, 8, remembers=False), seed=1)
    pairs, last = torch.randn(3, 5), torch.randn(3, LAST_COUNT)
    one, other = network(pairs, last, torch.zeros(3, 8)), network(pairs, last, torch.randn(3, 8))
    torch.testing.assert_close(one.scores, other.scores)


@pytest.mark.slow
def test_it_learns_to_say_that_it_has_arrived(tmp_path: Path):
    world = make_world(seen_by_eyes(tmp_path / "eyes", corridor_scene(5)), {"corridor": [8, 16]})
    learner = replace(LEARNER, frames=20_000, taught=1.0, envs=40, width=48, teacher_share=0.0)
    learner = replace(learner, taught_lr_start=3e-3, taught_lr_end=2e-3)
    trainer = trainer_of(world, learner)
    said = []
    while not trainer.finished:
        said.append(trainer.update()["arrival_loss"])
    assert said[-1] < 0.2 * said[0]
    agent = learner.agent(None, {**trainer.tensors(), **trainer.fixed_tensors()}, 0).on_poses(world)  # type: ignore[arg-type]
    table = run_episodes(world, agent, episodes_per_target=20, step_limit=200, seed=1)
    assert table.told_arrival is not None and table.false_arrivals is not None
    assert table.told_arrival[table.reached].mean() > 0.8
    assert (table.false_arrivals > 0).mean() < 0.2


def test_scenes_of_another_encoder_are_refused():
    world = make_world([corridor_scene(5)], {"corridor": [8]})
    with pytest.raises(
        RunError, match=r"the scenes are encoded by made-up\. Encode them with --encoder clearway, or a folder"
    ):
        LEARNER.trainer(world, COLLISION_AWARE, 0)


def test_pictures_of_another_aspect_are_warned_of_in_training_and_after_it(tmp_path: Path):
    wide = grid_scene(1, width=4, depth=3, picture_size=(9, 16), name="wide")
    seen, other = seen_by_eyes(tmp_path / "eyes", wide, replace(wide, name="other"))
    record: Any = None  # it is not asked
    network, pairs = RecurrentActorCritic(RecurrentShape(4, 8)), SeenPairs(small_eyes())
    with pytest.warns(AspectWarning, match=r"scene wide: .* Crop them to 12 x 9"):
        TrainedRecurrent(record, network, pairs, 0).seen([wide])
    with pytest.warns(AspectWarning) as told, pytest.raises(RunError, match="not a folder"):
        clearway.train([seen, other], algorithm=LEARNER, out=Path(__file__))
    assert [str(one.message).partition(":")[0] for one in told] == ["scene wide and 1 more"]


@pytest.mark.parametrize("name", ["taught", "teacher_share"])
def test_shares_of_more_than_all_are_refused(name: str):
    with pytest.raises(RunError, match=f"{name} is 1.5, expected 0 to 1"):
        replace(LEARNER, **{name: 1.5})


@pytest.mark.parametrize("name", ["taught_lr_start", "taught_lr_end", "lr_end"])
def test_rates_that_would_not_fall_geometrically_are_refused(name: str):
    with pytest.raises(RunError, match=f"{name} is 0.0, expected above 0"):
        replace(LEARNER, **{name: 0.0})


def test_the_last_step_is_told_by_action_and_likeness():
    told = last_step(torch.tensor([2, 0]), torch.tensor([0.5, 1.0]))
    assert told.tolist() == [[0, 0, 1, 0, 1, 0.5], [1, 0, 0, 0, 1, 1]] and told.shape[1] == LAST_COUNT


def test_pairs_are_standardised_and_kept_by_their_tensors(world: World):
    pairs = SeenPairs(small_eyes())
    assert world.features is not None
    seen, target = world.features[:30], world.features[torch.arange(30) % 7]
    pairs.fit(seen, target)
    told = pairs(seen, target)
    assert told.shape == (30, pairs.count) == (30, 16 + 5 + 1 + 4 + 63 + SMALL.grid.count)
    np.testing.assert_allclose(told.mean(0), 0, atol=1e-4)
    again = SeenPairs.from_tensors(pairs.tensors())
    torch.testing.assert_close(again(seen, target), told, rtol=0, atol=0)
    described = pairs.description(seen)
    torch.testing.assert_close(likeness(described, described), torch.ones(30))


def test_what_is_remembered_changes_what_is_said():
    network = RecurrentActorCritic(RecurrentShape(5, 8), seed=1)
    pairs, last = torch.randn(3, 5), torch.zeros(3, LAST_COUNT)
    first = network(pairs, last, torch.zeros(3, 8))
    second = network(pairs, last, first.hidden)
    assert (first.scores.shape, first.value.shape, first.hidden.shape) == ((3, 4), (3,), (3, 8))
    assert not torch.allclose(first.scores, second.scores)
