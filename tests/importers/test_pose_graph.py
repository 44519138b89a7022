import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers.pose_graph import recorded_pose_graph
from clearway.scenes.actions import Action
from helpers.made import graph_of_cells


def recorded(cells: np.ndarray, heading_count: int = 4, step_m: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Locations and headings of all poses of some cells."""
    headings_deg = np.tile(np.arange(heading_count) * 360 / heading_count, len(cells))
    return np.repeat(cells, heading_count, axis=0) * step_m, headings_deg


L_SHAPE = np.array([[0, 0], [0, 1], [0, 2], [1, 2]])


def test_the_graph_of_a_grid_is_the_grid_s() -> None:
    graph = recorded_pose_graph(*recorded(L_SHAPE), 0.5, source="poses.csv")
    np.testing.assert_array_equal(graph, graph_of_cells(L_SHAPE))


def test_any_order_of_poses_gives_the_same_graph() -> None:
    locations_m, headings_deg = recorded(L_SHAPE)
    order = np.random.default_rng(0).permutation(len(headings_deg))
    graph = recorded_pose_graph(locations_m[order], headings_deg[order], 0.5, source="poses.csv")
    place = np.argsort(order)
    expected = graph_of_cells(L_SHAPE)[order]
    np.testing.assert_array_equal(graph, np.where(expected < 0, -1, place[expected]))


def test_eight_headings_move_along_diagonals_where_a_location_lies_there() -> None:
    """Locations 0.5 m apart to the north (0), and to the north-east of it (45 degrees)."""
    places = np.array([[0, 0], [0, 0.5], [0.5 * np.sin(np.pi / 4), 0.5 * np.cos(np.pi / 4)]])
    locations_m, headings_deg = np.repeat(places, 8, axis=0), np.tile(np.arange(8) * 45.0, 3)
    graph = recorded_pose_graph(locations_m, headings_deg, 0.5, source="poses.csv")
    assert graph[0, Action.MOVE_FORWARD] == 8  # heading 0
    assert graph[1, Action.MOVE_FORWARD] == 17  # heading 45
    assert graph[21, Action.MOVE_FORWARD] == 5  # heading 225, back
    assert graph[17, Action.MOVE_BACKWARD] == 1
    assert graph[7, Action.TURN_RIGHT] == 0 and graph[0, Action.TURN_LEFT] == 7
    assert (graph[:, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]] >= 0).sum() == 8


def test_a_location_a_little_off_is_still_reached_and_one_far_off_is_not() -> None:
    for off_m, reached in ((0.04, True), (0.06, False)):
        locations_m, headings_deg = recorded(np.array([[0, 0], [0, 1], [1, 0]]))
        locations_m[4:8, 1] += off_m
        graph = recorded_pose_graph(locations_m, headings_deg, 0.5, source="poses.csv")
        assert (graph[0, Action.MOVE_FORWARD] == 4) == reached


@pytest.mark.parametrize(("origin_m", "hair"), [(0.0, 4e-4), (0.0625, 1e-12), (0.1125, 1e-12)])
def test_locations_a_hair_apart_are_one(origin_m: float, hair: float) -> None:
    """Wherever they lie: half millimetres are no borders."""
    locations_m, headings_deg = recorded(L_SHAPE)
    hair_m = origin_m + np.random.default_rng(0).uniform(-hair, hair, locations_m.shape)
    graph = recorded_pose_graph(locations_m + hair_m, headings_deg, 0.5, source="poses.csv")
    np.testing.assert_array_equal(graph, graph_of_cells(L_SHAPE))


def test_thousands_at_one_place_are_refused_without_their_pairs() -> None:
    locations_m = np.zeros((60_000, 2))
    locations_m[:, 0] = 1e-9 * np.arange(len(locations_m))
    with pytest.raises(SceneError, match=r"poses.csv: on average more than 100 locations lie within 0.001 m of a "):
        recorded_pose_graph(locations_m, np.zeros(len(locations_m)), 0.5, source="poses.csv")


def test_a_blocked_edge_is_blocked_both_ways_and_nothing_else() -> None:
    edge = np.array([[[0.0, 0.5], [0.0, 1.0]]])
    free = recorded_pose_graph(*recorded(L_SHAPE), 0.5, source="poses.csv")
    for edges in (edge, edge[:, ::-1]):
        graph = recorded_pose_graph(*recorded(L_SHAPE), 0.5, blocked_edges=edges, source="poses.csv")
        changed = np.argwhere(graph != free).tolist()
        forward, backward = Action.MOVE_FORWARD, Action.MOVE_BACKWARD
        assert changed == [[4, forward], [6, backward], [8, backward], [10, forward]]
        assert (graph[tuple(np.array(changed).T)] == -1).all()


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        (lambda x, h: (x[:-1], h[:-1]), ("(0.5, 1) lacks the heading 270",)),
        (lambda x, h: (np.vstack([x, x[:1]]), np.append(h, h[0])), ("poses 0 and 16 are the same: (0, 0), heading 0",)),
        (lambda x, h: (x, np.where(h == 90, 80, h)), ("pose 1 at (0, 0) has heading 80", "90 degrees apart")),
    ],
)
def test_faults_are_named(change, parts: tuple[str, ...]) -> None:
    with pytest.raises(SceneError) as caught:
        recorded_pose_graph(*change(*recorded(L_SHAPE)), 0.5, source="poses.csv")
    assert str(caught.value).startswith("poses.csv: ")
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "problem"),
    [(L_SHAPE, r"no move of 0\.3 m leads .*; the nearest two are 0\.5 m apart"), (L_SHAPE[:1], "there is only one")],
)
def test_a_step_that_leads_nowhere_is_refused(cells: np.ndarray, problem: str) -> None:
    with pytest.raises(SceneError, match=problem):
        recorded_pose_graph(*recorded(cells), 0.3, source="poses.csv")


@pytest.mark.parametrize("edge", [[[0, 0], [0, 1.0]], [[0, 0], [7, 7]], [[0.1, 0], [0, 0.5]]])
def test_a_blocked_edge_must_join_neighbours(edge: list) -> None:
    with pytest.raises(SceneError, match="joins no two neighbouring locations"):
        recorded_pose_graph(*recorded(L_SHAPE), 0.5, blocked_edges=np.array([edge]), source="poses.csv")
