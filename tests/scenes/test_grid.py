import numpy as np

from clearway.scenes.grid import connected_parts, edges_among, neighbour_pairs, pose_graph
from helpers.imported import imported_by


def test_pose_graph_of_two_cells_side_by_side() -> None:
    graph = pose_graph(np.array([[0, 0], [1, 0]]), np.array([[0, 1]]))
    assert graph[0].tolist() == [-1, 1, 3, -1]  # looking along +z
    assert graph[1].tolist() == [5, 2, 0, -1]  # looking along +x: forward to the other cell
    assert graph[3].tolist() == [-1, 0, 2, 7]  # looking along -x: backward to it
    assert graph[7].tolist() == [3, 4, 6, -1]


def test_no_edges_leave_only_turns() -> None:
    graph = pose_graph(np.array([[0, 0], [0, 1]]), np.zeros((0, 2), np.int64))
    assert (graph[:, [0, 3]] == -1).all()
    assert graph[4].tolist() == [-1, 5, 7, -1]


def test_neighbours_share_a_side() -> None:
    cells = np.array([[5, 5], [-1, 0], [0, 0], [-1, 1], [0, 2]])
    pairs, axes = neighbour_pairs(cells)
    assert pairs.tolist() == [[1, 2], [1, 3]]
    assert axes.tolist() == [0, 1]


def test_a_single_cell_has_no_neighbours() -> None:
    pairs, axes = neighbour_pairs(np.array([[3, 4]]))
    assert pairs.shape == (0, 2) and axes.shape == (0,)


def test_the_largest_part_comes_first_and_its_edges_are_renumbered() -> None:
    edges = np.array([[0, 2], [1, 3], [3, 4]])
    part, sizes = connected_parts(6, edges)
    assert part.tolist() == [1, 0, 1, 0, 0, 2]
    assert sizes == (3, 2, 1)
    assert edges_among(part == 0, edges).tolist() == [[0, 1], [1, 2]]


def test_a_grid_needs_no_simulator() -> None:
    assert "mujoco" not in imported_by("import clearway.scenes.grid")
