from dataclasses import replace

import numpy as np
import pytest

from clearway.scenes import graph as graphs
from clearway.scenes.actions import BLOCKED, Action
from helpers.made import corridor_scene, graph_of_cells, grid_scene


def test_a_blocked_move_stays() -> None:
    corridor = corridor_scene(2)
    ahead = graphs.next_states(corridor.graph)
    assert ahead.dtype == np.int64
    assert ahead[0].tolist() == [4, 1, 3, 0]  # forward, right, left, and backward into the wall
    assert ahead[1].tolist() == [1, 2, 0, 1]  # looking across the corridor, both moves are blocked


def test_corridor_distances_by_hand() -> None:
    steps = corridor_scene(5).distances
    assert steps.dtype == np.int32
    assert steps[0, 16] == 4  # straight ahead
    assert steps[16, 0] == 4  # backwards, without turning
    assert steps[0, 17] == 5  # and one right turn
    assert steps[1, 18] == 5  # turn right, walk four backwards
    assert steps[1, 19] == 6  # and turn right again
    assert np.diagonal(steps).max() == 0


def test_distances_to_is_the_transposed_column() -> None:
    scene = grid_scene(3)
    targets = np.array([1, scene.state_count - 1])
    assert np.array_equal(scene.distances_to(targets), scene.distances[:, targets].T)


def test_separate_parts_are_unreachable_and_the_largest_is_component_0() -> None:
    graph = graph_of_cells(np.array([[5, 5], [0, 0], [0, 1]]))
    steps = graphs.distances(graph)
    assert steps[0, 4] == steps[4, 0] == graphs.UNREACHABLE
    assert graphs.components(graph).tolist() == [1] * 4 + [0] * 8


def test_one_way_doors_make_two_strong_components() -> None:
    graph = graph_of_cells(np.array([[0, 0], [0, 1]]))
    graph[4:, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]] = BLOCKED  # nothing leads out of cell 1
    steps = graphs.distances(graph)
    assert steps[0, 4] == 1
    assert steps[4, 0] == graphs.UNREACHABLE
    assert len(set(graphs.components(graph).tolist())) == 2


@pytest.mark.parametrize("seed", range(4))
def test_distances_obey_every_edge(seed: int) -> None:
    scene = grid_scene(seed)
    ahead = graphs.next_states(scene.graph)
    assert (scene.distances >= 0).all()
    for target in (0, scene.state_count // 2):
        to_go = scene.distances[:, target]
        best = to_go[ahead].min(axis=1)
        away = np.arange(scene.state_count) != target
        assert np.array_equal(best[away], to_go[away] - 1)


def test_cells_are_numbered_by_first_appearance() -> None:
    scene = grid_scene(1)
    assert np.array_equal(scene.cells, np.repeat(np.arange(scene.cell_count), 4))


def test_cells_are_circles_of_turns_wherever_states_are_said_to_lie() -> None:
    scene = grid_scene(1)
    rng = np.random.default_rng(0)
    order = rng.permutation(scene.state_count)
    place = np.argsort(order)
    shuffled = np.where(scene.graph[order] == BLOCKED, BLOCKED, place[scene.graph[order]])
    jitter = rng.uniform(-3e-4, 3e-4, scene.locations_m.shape)
    moved = replace(scene, graph=shuffled.astype(np.int32), locations_m=(scene.locations_m + jitter)[order])
    number: dict[int, int] = {}
    assert moved.cells.tolist() == [number.setdefault(state // 4, len(number)) for state in order.tolist()]
    assert moved.cells.dtype == np.int64
    one_point = replace(scene, locations_m=np.zeros_like(scene.locations_m))
    assert one_point.cells.tolist() == [state // 4 for state in range(scene.state_count)]


@pytest.mark.parametrize("headings", [3, 7, 360])
def test_circles_of_any_number_of_turns_are_found(headings: int) -> None:
    cells, rng = 5, np.random.default_rng(headings)
    number = rng.permutation(cells * headings).reshape(cells, headings)
    graph = np.full((cells * headings, 4), BLOCKED, np.int32)
    graph[number, Action.TURN_RIGHT] = np.roll(number, -1, axis=1)
    found = graphs.turn_circles(graph)
    assert [len(set(found[circle].tolist())) for circle in number] == [1] * cells
    _, first = np.unique(found, return_index=True)
    assert (len(first), np.all(np.diff(first) > 0), found.dtype) == (cells, True, np.int64)


def test_two_actions_may_lead_to_one_state() -> None:
    graph = np.array([[1, 1, 1, 1], [0, 0, 0, BLOCKED], [0, 1, 2, 2]], np.int32)
    assert graphs.adjacency(graph).toarray().tolist() == [[0, 1, 0], [1, 0, 0], [1, 1, 1]]
    assert graphs.components(graph).tolist() == [0, 0, 1]
    assert graphs.distances_to(graph, np.array([0, 2])).tolist() == [[0, 1, 1], [-1, -1, 0]]
