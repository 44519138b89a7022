"""Tabular Q-learning: its rule by hand, its fixed point against the exact optimum, and its runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import RunError
from clearway.evaluation.oracle import action_values, make_task, optimal_policy
from clearway.evaluation.runs import evaluate_run
from clearway.learn.checkpoint import newest_checkpoint, read_network
from clearway.learn.load import load_agent, load_network, run_world
from clearway.learn.q_learning import QLearning, TableTrainer, best_actions, table_rows
from clearway.learn.train import train
from clearway.reward import COLLISION_AWARE, SHORTEST
from clearway.world.world import make_world
from helpers.agents import after_poses
from helpers.made import corridor_scene
from helpers.small_runs import (
    CORRIDOR_TARGETS,
    corridor_world,
    equal_bits,
    small_learner,
    small_request,
    small_scenes,
    small_world,
)

SMALL = small_learner(QLearning())


def test_a_row_for_every_target_and_pose_of_its_scene() -> None:
    """Scenes of 3 and 5 states, two targets in the first and one in the second."""
    first_row, rows = table_rows(torch.tensor([0, 3, 8]), torch.tensor([0, 0, 1]))
    assert rows == 3 + 3 + 5
    assert [int(first_row[0]) + state for state in (0, 2)] == [0, 2]
    assert [int(first_row[1]) + state for state in (0, 2)] == [3, 5]
    assert [int(first_row[2]) + state for state in (3, 7)] == [6, 10]


def test_the_best_actions_are_taken_alike() -> None:
    values = torch.tensor([[0.0, 2.0, 2.0, -1.0], [0.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.0, 0.9]])
    assert best_actions(values).tolist() == [[0, 0.5, 0.5, 0], [0.25] * 4, [1, 0, 0, 0]]


def test_steps_into_one_cell_move_it_by_the_mean_of_their_errors() -> None:
    trainer = TableTrainer(corridor_world(), replace(SMALL, step_size=0.5), SHORTEST, 0)
    cells = [3, 0], [1, 2]  # rows and actions
    trainer.values[cells] = torch.tensor([1.0, 4.0])
    error = trainer._learn(torch.tensor([13, 13, 2]), torch.tensor([2.0, 4.0, 0.0]))
    assert error.item() == pytest.approx((1 + 3 + 4) / 3)
    assert trainer.values[cells].tolist() == [1 + 0.5 * 2, 4 - 0.5 * 4]
    assert trainer.values.count_nonzero() == 2


@pytest.mark.slow
@pytest.mark.parametrize("step_limit", [12, 60])
def test_the_table_becomes_that_of_the_exact_optimum(step_limit: int) -> None:
    """Not with cuts that count as ends, which the short limit would show."""
    learner = QLearning(frames=60_000, envs=20, step_limit=step_limit, discount=0.9, explore_end=1.0)
    scene = corridor_scene(5)
    world = make_world([scene], {"corridor": CORRIDOR_TARGETS})
    trainer = TableTrainer(world, learner, COLLISION_AWARE, 0)
    while not trainer.finished:
        trainer.update()
    for index, target in enumerate(CORRIDOR_TARGETS):
        task = make_task(scene.graph, world.zone.numpy(), target, COLLISION_AWARE)
        value = np.zeros(scene.state_count)
        for _ in range(300):
            value = action_values(task, value, 0.9).max(1)
        exact = action_values(task, value, 0.9)[task.starts]
        rows = trainer.values[trainer.first_row[index] + torch.from_numpy(task.starts)]
        np.testing.assert_allclose(rows.numpy(), exact, atol=1e-4)
        optimal = optimal_policy(task, 0.9)[task.starts]
        assert ((best_actions(rows).numpy() > 0) <= (optimal > 0)).all()


def test_the_target_s_own_values_stay_0_and_cut_episodes_begin_anew() -> None:
    trainer = TableTrainer(small_world(), replace(SMALL, step_limit=3), COLLISION_AWARE, 0)
    for _ in range(20):
        trainer.update()
        assert trainer.navigation.elapsed.max() < 3
    world = trainer.world
    assert not trainer.values[trainer.first_row + world.target_state].any()
    totals = trainer.statistics.take().sum(0)
    assert totals[2] / totals[0] <= 3  # steps an episode


@pytest.mark.slow
def test_a_run_evaluates_at_the_shortest_paths_and_has_no_network(tmp_path: Path) -> None:
    request = small_request(learner=replace(SMALL, frames=40_000, envs=20), reward=SHORTEST)
    folder = train(request, tmp_path)
    row = folder.metrics()[-1]
    assert set(row) >= {"episodes", "success", "value_error", "explore"}
    assert not set(row) & {"loss", "entropy", "lr", "gradient_norm"}
    agent = load_agent(tmp_path)
    found = evaluate_run(agent, small_scenes(), episodes_per_target=20, step_limit=100)
    by_name = {evaluation.agent: evaluation.to_json()["average"] for evaluation in found}
    learnt, shortest = by_name["shortest"], by_name["shortest path"]
    assert learnt["steps"] == pytest.approx(shortest["steps"], rel=0.02)
    with pytest.raises(RunError, match="an agent of q-learning has none"):
        load_network(tmp_path)


def test_a_table_knows_its_own_targets_and_scenes_alone(tmp_path: Path) -> None:
    train(small_request(learner=replace(SMALL, frames=80)), tmp_path)
    agent = load_agent(tmp_path)
    scenes = small_scenes()
    some = make_world(scenes, {"corridor": (8,), "grid": (22, 5)})  # in another order
    assert repr(agent) == "<TrainedTable: q-learning, 80 frames in corridor, grid>"
    whole = run_world(agent.record, scenes)
    state, ours = torch.tensor([[3], [1], [25]]), torch.tensor([0, 0, 1])
    theirs = torch.tensor([1, 1, 4])
    found, same = (
        after_poses(agent.on_poses(world), world, state, to) for world, to in ((some, ours), (whole, theirs))
    )
    assert np.array_equal(found.probabilities, same.probabilities) and np.array_equal(found.value, same.value)
    assert np.array_equal(found.action, same.action)
    with pytest.raises(RunError, match=r"corridor: no table for target 4. .*: 0, 8, 16"):
        agent.on_poses(make_world(scenes, {"corridor": (4,), "grid": (5,)}))
    with pytest.raises(RunError, match="the scenes are"):
        agent.on_poses(make_world(scenes[:1], {"corridor": (8,)}))


def test_a_seed_repeats_and_tensors_bring_a_trainer_back_bit_for_bit(tmp_path: Path) -> None:
    request = small_request(learner=SMALL)
    saved = read_network(newest_checkpoint(train(request, tmp_path).checkpoints))
    assert set(saved) == {"table.values"}
    first, second = request.trainer(), request.trainer()
    for _ in range(4):
        first.update()
    second.load_tensors({name: tensor.clone() for name, tensor in first.tensors().items()}, first.frames, first.updates)
    while not second.finished:
        second.update()
    assert equal_bits(saved, {"table.values": second.tensors()["table.values"]})
    other = TableTrainer(small_world(), SMALL, COLLISION_AWARE, 4)
    while not other.finished:
        other.update()
    assert not torch.equal(other.values, saved["table.values"])


@pytest.mark.parametrize(("name", "value"), [("step_size", 1.5), ("explore_end", -0.1), ("envs", 0), ("discount", 2.0)])
def test_settings_out_of_range_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(RunError, match=f"{name} is {value}"):
        QLearning(**{name: value})
