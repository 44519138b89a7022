"""Floor plans typed in by hand, as scenes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.feature_spread import feature_spread
from clearway.scenes.floor_plans import CELL_SIZE_M, MAX_WALLS, Area, FloorPlan, Furnishing, parts_apart
from clearway.scenes.plan_scenes import floor_plan_scene, plan_of
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import check_scene, pose_quirks
from clearway.world.world import make_world
from helpers.imported import imported_by

# An L seen from above; the cells' numbers by x, then z:
#   . #      1
#   . .      0 2
ELL = np.array([[True, True], [True, False]])  # [x, z]
ELL_GRAPH = [  # forward, right, left, backward
    [4, 1, 3, -1],  # cell 0 at (0, 0), looking along +z at cell 1
    [9, 2, 0, -1],  # along +x at cell 2
    [-1, 3, 1, 6],  # along -z, cell 1 behind
    [-1, 0, 2, 11],  # along -x, cell 2 behind
    [-1, 5, 7, 0],  # cell 1 at (0, 1): cell 0 behind
    [-1, 6, 4, -1],
    [2, 7, 5, -1],  # along -z at cell 0
    [-1, 4, 6, -1],
    [-1, 9, 11, -1],  # cell 2 at (1, 0)
    [-1, 10, 8, 1],  # along +x: cell 0 behind
    [-1, 11, 9, -1],
    [3, 8, 10, -1],  # along -x at cell 0
]


def square(side: int, name: str = "square") -> FloorPlan:
    return FloorPlan.of_map(name, np.ones((side, side), bool))


def test_an_ell_becomes_the_graph_drawn_by_hand() -> None:
    scene = floor_plan_scene(FloorPlan.of_map("ell", ELL), feature_count=8)
    assert scene.graph.tolist() == ELL_GRAPH
    assert scene.graph.dtype == np.int32
    assert scene.locations_m.tolist() == [[0, 0]] * 4 + [[0, 0.25]] * 4 + [[0.25, 0]] * 4
    assert scene.headings_deg.tolist() == [0, 90, 180, 270] * 3
    assert (scene.name, scene.cell_size_m, scene.cell_count) == ("ell", CELL_SIZE_M, 3)
    assert scene.observations is None and scene.top_view is None


def test_cells_keep_their_order_and_place() -> None:
    cells = np.array([[-3, 7], [-4, 7], [9, 9]], np.int16)
    scene = floor_plan_scene(FloorPlan("plan", cells, cell_size_m=0.5), feature_count=8)
    assert scene.locations_m[::4].tolist() == [[-1.5, 3.5], [-2.0, 3.5], [4.5, 4.5]]
    assert scene.graph[3].tolist() == [7, 0, 2, -1]  # looking along -x at the cell before it
    assert scene.components.tolist() == [0] * 8 + [1] * 4  # the lone cell stays


def test_a_blocked_edge_is_no_way_in_either_direction() -> None:
    blocked = np.array([[[1, 0], [0, 0]]])
    scene = floor_plan_scene(FloorPlan.of_map("ell", ELL, blocked), feature_count=8)
    expected = [list(row) for row in ELL_GRAPH]
    expected[1][0] = expected[3][3] = expected[9][3] = expected[11][0] = -1
    assert scene.graph.tolist() == expected


def test_unsigned_cells_have_neighbours_too() -> None:
    plan = FloorPlan.of_map("ell", ELL)
    unsigned = replace(plan, cells=plan.cells.astype(np.uint8))
    assert floor_plan_scene(unsigned, feature_count=8).graph.tolist() == ELL_GRAPH


def test_the_scene_is_sound_and_survives_its_file(tmp_path: Path) -> None:
    scene = floor_plan_scene(FloorPlan.of_map("ell", ELL), feature_count=20, seed=3)
    check_scene(scene)
    assert pose_quirks(scene) == []
    write_scene(scene, tmp_path / "ell.h5")
    read = read_scene(tmp_path / "ell.h5")
    assert np.array_equal(read.graph, scene.graph) and np.array_equal(read.features, scene.features)
    assert (read.made_by.source, read.made_by.seed) == ("floor_plan", 3)
    assert "made-up" in str(read.made_by.notes["features"])
    assert (read.encoder.name, read.encoder.settings["feature_count"]) == ("made-up", 20)


def test_features_repeat_and_depend_on_seed_and_name() -> None:
    scene = floor_plan_scene(square(3), feature_count=16)
    again = floor_plan_scene(square(3), feature_count=16)
    assert np.array_equal(scene.features, again.features)
    for other in (
        floor_plan_scene(square(3), feature_count=16, seed=1),
        floor_plan_scene(square(3, "other"), feature_count=16),
    ):
        assert not np.isclose(scene.features, other.features).any(axis=1).all()


def test_features_tell_poses_apart_and_are_smooth() -> None:
    scene = floor_plan_scene(square(12), feature_count=512)
    assert scene.features.dtype == np.float32 and scene.features.shape == (576, 512)
    assert (scene.features >= 0).all()
    assert feature_spread(scene.features).closest_cosine_distance > 0.005
    centred = scene.features - scene.features.mean(axis=0)
    directions = centred / np.linalg.norm(centred, axis=1, keepdims=True)
    first = directions[:4] @ directions.T
    beside, far = first[0, 4], first[0, 4 * 11]  # 0.25 m and 2.75 m along z, same heading
    assert beside > 0.85 > 0.5 > abs(far)
    assert abs(first[0, 1]) < 0.5  # a turn shows something else


def test_scenes_of_one_size_and_seed_go_together() -> None:
    def scene(name: str, feature_count: int = 16, seed: int = 0):
        return floor_plan_scene(square(3, name), feature_count, seed)

    targets = {"a": [0], "b": [0]}
    assert make_world([scene("a"), scene("b")], targets).state_count == 72
    for other in (scene("b", feature_count=17), scene("b", seed=1)):
        with pytest.raises(SceneError, match="b, dataset 'resnet_feature'"):
            make_world([scene("a"), other], targets)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cells": np.zeros((0, 2), np.int64)}, r"has 0 reachable cells, expected 1 to 16384"),
        ({"cells": np.zeros((16_385, 2), np.int64)}, r"has 16385 reachable cells"),
        ({"cells": np.zeros((2, 3), np.int64)}, r"is int64 of shape \(2, 3\), expected whole numbers \(cells, 2\)"),
        ({"cells": np.zeros((2, 2))}, r"is float64 of shape \(2, 2\)"),
        ({"cells": np.array([[0, 0], [1, 0], [0, 0]])}, r"names the cell \(0, 0\) twice"),
        ({"cells": np.array([[0, 40_001]])}, r"more than 10,000 m away"),
        ({"cells": np.array([[-(2**63), 0]])}, r"more than 10,000 m away"),
        ({"cell_size_m": 0.0}, r"cell size of 0.0 m.*above 0"),
        ({"cell_size_m": float("nan")}, r"cell size of nan m"),
        ({"blocked_edges": np.array([[[0, 0], [1, 1]]])}, r"blocked edge of \(0, 0\) and \(1, 1\).*neighbouring"),
        ({"blocked_edges": np.array([[0, 0, 1, 0]])}, r"shape \(1, 4\), expected whole numbers \(edges, 2, 2\)"),
    ],
)
def test_plans_that_are_none(changes: dict, message: str) -> None:
    with pytest.raises(SceneError, match=f"^plans.npz, dataset 'ell': .*{message}"):
        replace(FloorPlan.of_map("ell", ELL, source="plans.npz", dataset="ell"), **changes)


@pytest.mark.parametrize(
    ("feature_count", "seed", "message"),
    [
        (0, 0, "0 features asked for, 12 states can have 1 to 65536"),
        (65_537, 0, "65537 features"),
        (8, -1, "the seed must be 0 or more, found -1"),
    ],
)
def test_features_that_cannot_be_made(feature_count: int, seed: int, message: str) -> None:
    with pytest.raises(SceneError, match=f"^ell: {message}"):
        floor_plan_scene(FloorPlan.of_map("ell", ELL), feature_count, seed)


def test_more_features_than_a_file_may_hold() -> None:
    with pytest.raises(SceneError, match="65536 states can have 1 to 8192"):
        floor_plan_scene(square(128), 8193)


def test_a_plan_needs_neither_simulator_nor_torch() -> None:
    assert not {"mujoco", "torch"} & imported_by("import clearway.scenes.floor_plan_files")


ROW = np.array([[0, 0], [1, 0], [2, 0]])


SOFA = Furnishing("sofa", (0, 1), (1, 1), "south")


def test_walls_and_doors_and_areas_stand_in_a_plan() -> None:
    plan = FloorPlan(
        "flat", ROW, walls=np.array([[1, 1]]), doors=np.array([[1, 0]]), areas=(Area("kitchen", (0, 0), (0, 0)),)
    )
    assert plan.walls.tolist() == [[1, 1]] and plan.doors.tolist() == [[1, 0]] and len(plan.edges) == 2


@pytest.mark.parametrize(
    ("parts", "problem"),
    [
        ({"walls": np.array([[1, 0]])}, r"has a wall in the cell \(1, 0\) that can be entered"),
        ({"doors": np.array([[1, 1]])}, r"has a door in the cell \(1, 1\) that cannot be entered"),
        ({"walls": np.array([[0, 40_001]])}, "has walls more than 10,000 m away.*Move the plan"),
        ({"walls": np.zeros((MAX_WALLS + 1, 2), int)}, f"has {MAX_WALLS + 1} walls, at most {MAX_WALLS}"),
        ({"walls": np.array([[0.5, 0]])}, r"has walls of float64 and shape \(1, 2\), expected whole numbers"),
        ({"doors": np.array([1, 1])}, r"has doors of int64 and shape \(2,\), expected whole numbers"),
        ({"areas": (Area("garage", (0, 0), (1, 1)),)}, "has the area .*garage.*Give a use among bathroom"),
        ({"areas": (Area("kitchen", (1, 0), (0, 0)),)}, "has the area .*kitchen"),
        ({"furniture": (Furnishing("throne", (0, 1), (1, 1), "north"),)}, "has the furniture .*throne.*Give a kind of"),
        ({"furniture": (Furnishing("sofa", (0, 1), (1, 1), "up"),)}, "has the furniture .*up"),
        ({"furniture": (Furnishing("sofa", (1, 1), (0, 1), "north"),)}, "has the furniture .*sofa"),
        ({"furniture": (Furnishing("sofa", (0, 1), (1, 99), "north"),)}, "has the furniture .*sofa"),
        ({"furniture": (SOFA, SOFA)}, r"has a sofa in the cell \(0, 1\) that is taken. Put it on blocked cells"),
        ({"furniture": (replace(SOFA, low=(0, 0)),)}, r"has a sofa in the cell \(0, 0\) that is taken"),
    ],
)
def test_parts_that_are_none_are_refused(parts, problem) -> None:
    with pytest.raises(SceneError, match=problem):
        FloorPlan("flat", ROW, **parts)


def test_a_map_in_characters_is_a_plan_with_walls_and_doors() -> None:
    plan = FloorPlan.of_text("flat", ("W.#", "WD."), areas=(Area("kitchen", (1, 0), (2, 1)),), cell_size_m=0.5)
    assert plan.cells.tolist() == [[1, 0], [1, 1], [2, 0]]  # by x, then z; the last line is z = 0
    assert plan.walls.tolist() == [[0, 0], [0, 1]] and plan.doors.tolist() == [[1, 0]]
    assert plan.has_walls and plan.areas[0].use == "kitchen" and plan.cell_size_m == 0.5
    plain = FloorPlan.of_text("ell", (".#", ".."))
    assert not plain.has_walls and np.array_equal(plain.cells, FloorPlan.of_map("ell", ELL).cells)


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        (("..", "."), r"^flat: line 2 has 1 cells, the first has 2"),
        (("..", ".w"), r"^flat: line 2, column 2 holds 'w'. Write # .*, \. .*, W for a wall and D for a door in it"),
        ((), "^flat: is empty"),
        (("WW",), "^flat: has 0 reachable cells"),
    ],
)
def test_maps_in_characters_that_are_none(lines: tuple[str, ...], problem: str) -> None:
    with pytest.raises(SceneError, match=problem):
        FloorPlan.of_text("flat", lines)


def test_parts_that_cannot_be_reached_are_named_in_one_line() -> None:
    assert parts_apart(FloorPlan.of_text("hall", ("..", ".."))) == ""
    one = FloorPlan.of_text("hall", ("..W.", "..W."))
    kept = "reached from the largest part (kept in the scene)"
    assert parts_apart(one) == f"hall: 1 part cannot be {kept}: 2 cells at (3, 0), (3, 1)"
    three = FloorPlan.of_text("hall", ("...#.", "####.", "..#.#"))
    assert (
        parts_apart(three, most=1) == f"hall: 3 parts cannot be {kept}: 2 cells at (0, 0) and 1 more; 3 cells in 2 more"
    )


def test_a_scene_gives_its_plan_back_from_its_file_too(tmp_path: Path) -> None:
    reachable = np.ones((4, 3), bool)
    reachable[2, 1] = False
    drawn = FloorPlan.of_map("drawn", reachable, np.array([[[0, 1], [0, 0]]]), cell_size_m=0.3)
    plan = replace(
        drawn,
        cells=drawn.cells[::-1] - 2,
        blocked_edges=drawn.blocked_edges - 2,
        walls=np.array([[5, -1]]),
        doors=np.array([[1, 0]]),
        areas=(Area("kitchen", (-2, -2), (-1, 0)),),
        furniture=(Furnishing("island", (0, -1), (0, -1), "east"),),
    )
    made = floor_plan_scene(plan, feature_count=4)
    write_scene(made, tmp_path / "drawn.h5")
    for scene in (made, read_scene(tmp_path / "drawn.h5")):
        again = plan_of(scene)
        assert (again.name, again.cell_size_m, again.areas) == ("drawn", 0.3, plan.areas)
        assert again.furniture == plan.furniture
        for name in ("cells", "edges", "walls", "doors"):
            np.testing.assert_array_equal(getattr(again, name), getattr(plan, name))
        np.testing.assert_array_equal(floor_plan_scene(again, feature_count=4).features, made.features)


def test_a_plan_of_nothing_but_cells_needs_no_record() -> None:
    scene = floor_plan_scene(FloorPlan.of_map("open", np.ones((2, 2), bool)), feature_count=4)
    assert "plan" not in scene.made_by.notes
    assert len(plan_of(scene).edges) == 4


DAMAGED_AREAS = (
    {"areas": [["attic", [0, 0]]]},
    {"areas": [["bathroom", [0], [1]]]},
    {"areas": [["bathroom", ["a", 0], [1, 1]]]},
    {"areas": [["bathroom", [0, 0], [1, 1.5]]]},
    {"areas": [["bathroom", [True, 0], [1, 1]]]},
)
DAMAGED_FURNITURE = (
    {"furniture": [["sofa", [9, 9, 9], [9], "south"]]},
    {"furniture": [["sofa", [0, 0], [0, 0]]]},
    {"furniture": [["sofa", [0, 0, 0], [0, 0], "north"]]},
    {"furniture": [["sofa", ["0", 0], [0, 0], "north"]]},
)


def test_scenes_without_a_plan_are_refused() -> None:
    scene = floor_plan_scene(FloorPlan.of_map("open", np.ones((2, 2), bool)), feature_count=4)
    askew = replace(scene, locations_m=scene.locations_m + 0.1)
    with pytest.raises(SceneError, match=r"open: its poses are not those of a floor plan\. Make the scene"):
        plan_of(askew)
    for parts in (*DAMAGED_AREAS, {"walls": ["here"]}, {"walls": [[2**70, 1]]}, *DAMAGED_FURNITURE, 3):
        damaged = replace(scene, made_by=replace(scene.made_by, notes={"plan": parts}))
        with pytest.raises(SceneError, match="the record of its floor plan is damaged"):
            plan_of(damaged)
