"""Episodes against known truths: hitting times of the random walk, shortest paths, dead ends and circles."""

import numpy as np
import pytest
import torch
from torch import Tensor

from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.agents.selection import Argmax
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.scenes.actions import Action
from clearway.world.world import World, make_world
from clearway.zones import Zone
from helpers.agents import alike, arbitrary, by_rule, only
from helpers.made import corridor_scene, grid_scene, scene_of_cells

COUNTS = ("target", "start", "steps", "collisions", "reached", "shortest_path_steps", "zone_steps", "looped")


def same(a: EpisodeTable, b: EpisodeTable) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in COUNTS)


@pytest.fixture(scope="module")
def world() -> World:
    grid, corridor = grid_scene(3), corridor_scene(5, feature_count=32)
    return make_world([grid, corridor], {"grid": [0, 13, 31], "corridor": [19, 2]})


def test_the_shortest_path_agent_takes_shortest_paths(world):
    table = run_episodes(world, shortest_paths(world), episodes_per_target=50)
    assert table.reached.all()
    assert np.array_equal(table.steps, table.shortest_path_steps)
    assert table.collisions.sum() == 0
    assert np.array_equal(table.zone_steps.sum(1), table.steps - table.reached)


def test_random_walk_on_one_cell_takes_20_thirds_steps():
    # Every move is blocked and half of all actions turn. The walk over four headings needs 3, 4, 3 turns on average
    # from 90, 180, 270 degrees to 0, so 6, 8, 6 steps, half of them collisions.
    world = make_world([scene_of_cells(np.array([[0, 0]]), name="cell")], {"cell": [0]})
    table = run_episodes(world, RandomWalk(), episodes_per_target=20_000)
    assert abs(table.steps.mean() - 20 / 3) < 4 * table.steps.std() / np.sqrt(20_000)
    assert abs(table.collisions.mean() - 10 / 3) < 4 * table.collisions.std() / np.sqrt(20_000)
    assert np.array_equal(table.zone_steps[:, Zone.COLLISION], table.steps - table.reached)


@pytest.mark.slow
def test_random_walk_agrees_with_the_solved_hitting_time(world):
    episodes = 1000
    table = run_episodes(world, RandomWalk(), episodes_per_target=episodes, step_limit=100_000)
    next_state = world.next_state.numpy()
    for target in range(world.target_count):
        mine = table.target == target
        first = world.start_offset[target]
        starts = world.start_state[first : first + world.start_count[target]].numpy()
        assert set(table.start[mine]) <= set(starts.tolist())
        walk = np.zeros((world.state_count, world.state_count))
        np.add.at(walk, (np.arange(world.state_count)[:, None], next_state), 0.25)
        walk = walk[np.ix_(starts, starts)]
        hitting = np.linalg.solve(np.eye(len(starts)) - walk, np.ones(len(starts)))
        assert abs(table.steps[mine].mean() - hitting.mean()) < 4 * table.steps[mine].std() / np.sqrt(episodes)


def test_walking_forward_into_a_dead_end_collides_at_every_further_step():
    length, cap = 6, 1234
    world = make_world([corridor_scene(length)], {"corridor": [1]})  # heading 90: forward never gets there
    table = run_episodes(world, by_rule(world, only(Action.MOVE_FORWARD)), step_limit=cap)
    cell, heading = table.start // 4, table.start % 4
    free_moves = np.select([heading == 0, heading == 2], [length - 1 - cell, cell], 0)
    assert not table.reached.any()
    assert (table.steps == cap).all()
    assert np.array_equal(table.collisions, cap - free_moves)
    assert np.array_equal(table.zone_steps.sum(1), table.steps - table.reached)


def test_turning_for_ever_is_a_failure_with_the_steps_of_the_cap_and_no_collision():
    world = make_world([corridor_scene(3)], {"corridor": [0]})
    table = run_episodes(world, by_rule(world, only(Action.TURN_LEFT)), episodes_per_target=200, step_limit=10_001)
    elsewhere = table.start // 4 != 0
    assert np.array_equal(table.reached, ~elsewhere)
    assert (table.steps[elsewhere] == 10_001).all() and (table.collisions == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_circles_completed_by_arithmetic_count_like_circles_walked(world, seed):
    agent = Argmax(by_rule(world, arbitrary(seed)))
    settings = {"episodes_per_target": 20, "step_limit": 977 + seed}
    skipped = run_episodes(world, agent, **settings)
    walked = run_episodes(world, agent, record=True, **settings)
    assert not skipped.reached.all(), "this agent shows nothing: it has no circle"
    assert same(skipped, walked)


@pytest.mark.slow
def test_an_agent_that_is_only_sometimes_certain_is_not_cut_short(world):
    def chances(history: Tensor, target: Tensor) -> Tensor:
        certain = torch.nn.functional.one_hot(arbitrary(1)(history, target).argmax(1), 4).double()
        return torch.where((history[:, -1:] % 3 == 0), torch.full_like(certain, 0.25), certain)

    agent = by_rule(world, chances)
    settings = {"episodes_per_target": 50, "step_limit": 700}
    assert same(run_episodes(world, agent, **settings), run_episodes(world, agent, record=True, **settings))


@pytest.mark.parametrize("random", [True, False])
def test_an_episode_is_the_same_whatever_runs_beside_it(world, random):
    agent = RandomWalk() if random else by_rule(world, arbitrary(0, greed=0.5))
    settings = {"episodes_per_target": 12, "step_limit": 150, "seed": 5}
    together = run_episodes(world, agent, **settings)
    assert same(together, run_episodes(world, agent, episodes_at_once=7, **settings))
    more = run_episodes(world, agent, **{**settings, "episodes_per_target": 15})
    firsts = np.arange(len(more)) % 15 < 12
    assert np.array_equal(more.steps[firsts], together.steps)


@pytest.mark.slow
def test_another_target_in_the_world_changes_no_episode():
    grid = grid_scene(3)
    alone = run_episodes(make_world([grid], {"grid": [13]}), RandomWalk(), episodes_per_target=20)
    beside = run_episodes(make_world([grid], {"grid": [0, 13]}), RandomWalk(), episodes_per_target=20)
    assert np.array_equal(alone.steps, beside.steps[20:])


def test_a_seed_repeats_and_another_differs(world):
    first, again, other = (run_episodes(world, RandomWalk(), episodes_per_target=20, seed=seed) for seed in (1, 1, 2))
    assert same(first, again)
    assert not np.array_equal(first.start, other.start)


def test_all_agents_face_the_same_starts(world):
    walked = run_episodes(world, RandomWalk(), episodes_per_target=20)
    ideal = run_episodes(world, shortest_paths(world), episodes_per_target=20)
    assert np.array_equal(walked.start, ideal.start)


def test_trajectories_obey_the_graph_and_end_at_the_target(world):
    table = run_episodes(world, RandomWalk(), episodes_per_target=10, step_limit=200, record=True)
    assert table.trajectories is not None and len(table.trajectories) == len(table)
    next_state, blocked = world.next_state.numpy(), world.blocked.numpy()
    for index, walk in enumerate(table.trajectories):
        assert len(walk.actions) == table.steps[index]
        assert walk.states[0] == table.start[index]
        assert np.array_equal(walk.states[1:], next_state[walk.states[:-1], walk.actions])
        assert blocked[walk.states[:-1], walk.actions].sum() == table.collisions[index]
        goal = int(world.target_state[table.target[index]])
        assert (walk.states[-1] == goal) == table.reached[index]
        assert goal not in walk.states[:-1]


def test_actions_are_sampled_with_their_probabilities():
    # One cell, target straight behind: turning right has weight 1, left 2, moving (blocked) 3 and 0.
    world = make_world([scene_of_cells(np.array([[0, 0]]), name="cell")], {"cell": [2]})
    table = run_episodes(world, by_rule(world, alike(3.0, 1.0, 2.0, 0.0)), episodes_per_target=2000, record=True)
    taken = np.concatenate([walk.actions for walk in table.trajectories])
    share = np.bincount(taken, minlength=4) / len(taken)
    assert share[3] == 0
    assert np.allclose(share[:3], [3 / 6, 1 / 6, 2 / 6], atol=4 * 0.5 / np.sqrt(len(taken)))
