"""The rooms of floor plans: what MuJoCo measures in them is the plan, and what the camera sees."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clearway.errors import SceneError
from clearway.rooms.camera import first_person_view
from clearway.rooms.daytime import DAYTIMES, NOON
from clearway.rooms.groups import SEEN_GROUP
from clearway.rooms.plans import plan_room
from clearway.rooms.plans.plan_room import build_plan_room, open_plan
from clearway.rooms.render import render
from clearway.scenes.floor_plan_files import floor_plan_names, read_floor_plan
from clearway.scenes.floor_plans import Area, FloorPlan, Furnishing
from helpers.imported import imported_by
from helpers.plan_maps import ELL, FLAT, ISLAND, MAPS, plan_of, walled

EXAMPLES = settings(max_examples=25, deadline=None, derandomize=True)
REAL_PLANS = Path(
    os.environ.get("CLEARWAY_FLOOR_PLANS") or Path(__file__).parents[3] / "../shared/data/ithor_floor_plans.npz"
)
REAL_PLAN_COUNT = 48
STEPS = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}


def rows(array: np.ndarray) -> list:
    return sorted(row.ravel().tolist() for row in array)


def free_edges(plan: FloorPlan) -> list:
    """Every pair of neighbouring cells that is not blocked, the lower cell first: by definition."""
    cells = {tuple(cell) for cell in plan.cells.tolist()}
    blocked = {frozenset(map(tuple, edge)) for edge in plan.blocked_edges.tolist()}
    pairs = [((x, z), (x + dx, z + dz)) for x, z in cells for dx, dz in ((1, 0), (0, 1))]
    return sorted([*a, *b] for a, b in pairs if b in cells and frozenset((a, b)) not in blocked)


def assert_room_is_the_plan(plan: FloorPlan, seed: int = 0) -> None:
    cells, edges = open_plan(*build_plan_room(plan, seed, looks=False))
    assert rows(cells) == rows(plan.cells)
    assert rows(edges) == free_edges(plan)


@pytest.mark.parametrize("cell_size_m", [0.2, 0.25, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("name", MAPS)
def test_the_obstacles_leave_exactly_the_plan_open(name: str, cell_size_m: float) -> None:
    for seed in range(2):
        assert_room_is_the_plan(plan_of(name, MAPS[name], cell_size_m=cell_size_m), seed)


@pytest.mark.parametrize("cell_size_m", [0.2, 0.25, 0.5, 1.0, 2.0])
def test_walls_and_doors_leave_exactly_the_plan_open(cell_size_m: float) -> None:
    for plan in (walled("flat", FLAT, cell_size_m=min(cell_size_m, 1.5)), walled(cell_size_m=cell_size_m)):
        for seed in range(2):
            assert_room_is_the_plan(plan, seed)


@EXAMPLES
@given(
    st.integers(1, 8)
    .flatmap(lambda width: st.lists(st.text("..##WWD", min_size=width, max_size=width), min_size=1, max_size=8))
    .filter(lambda lines: "." in "".join(lines)),
    st.integers(0, 99),
    st.sampled_from([0.2, 0.5, 2.0]),
)
def test_any_map_with_walls_and_doors_is_built_or_has_a_door_in_no_wall(lines, seed, cell_size_m) -> None:
    try:
        assert_room_is_the_plan(FloorPlan.of_text("any", lines, cell_size_m=cell_size_m), seed)
    except SceneError as error:
        assert "that is in no wall" in str(error)


def test_a_blocked_edge_blocks_that_move_and_no_other() -> None:
    blocked = [[[0, 0], [0, 1]], [[1, 0], [1, 1]], [[4, 2], [5, 2]]]  # two side by side, one across
    for cell_size_m in (0.2, 0.5, 2.0):
        assert_room_is_the_plan(plan_of("island", ISLAND, blocked, cell_size_m))


def test_cells_may_lie_anywhere_in_any_order() -> None:
    assert_room_is_the_plan(FloorPlan("far", np.array([[-7, 40], [-8, 40], [-3, 42]], np.int16)))


@EXAMPLES
@given(arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9))).filter(np.any), st.integers(0, 99))
def test_any_map_with_any_blocked_edges(reachable: np.ndarray, seed: int) -> None:
    open_way = FloorPlan.of_map("any", reachable)
    some = open_way.cells[open_way.edges][:: 1 + seed % 4]
    assert_room_is_the_plan(FloorPlan.of_map("any", reachable, some), seed)


def test_a_room_that_leaves_another_plan_open_is_not_passed_on(monkeypatch) -> None:
    monkeypatch.setattr(plan_room, "furnish", lambda room, pieces, nearest_m: [0.0] * len(pieces))
    with pytest.raises(AssertionError, match="the room of island is another plan"):
        build_plan_room(plan_of("island", ISLAND), looks=False)


@pytest.mark.parametrize(
    ("plan", "seed", "message"),
    [
        (plan_of("fine", ("...",), cell_size_m=0.1), 0, r"fine: has cells of 0.1 m, those of 0.2 to 2.0 m"),
        (plan_of("coarse", ("...",), cell_size_m=3.0), 0, r"coarse: has cells of 3.0 m"),
        (plan_of("hall", ("." * 46,) * 46), 0, r"hall: has 2116 reachable cells, 2048 can be rendered"),
        (FloorPlan("long", np.array([[0, 0], [200, 0]])), 0, r"long: spans 50.2 x 0.2 m, 40 m to a side"),
        (FloorPlan("wide", np.array([[0, 0], [99, 99]])), 0, r"wide: spans 25.0 x 25.0 m, .* 400 square metres"),
        (walled("maze", ("W.W.W.W.W.W",) * 9), -1, r"maze: the seed must be 0 or more"),
        (
            walled("cells", ("." + "W." * 20, "W" * 41, "." + "W." * 20)),
            0,
            r"cells: has 42 rooms between its walls, 40 can be lit. Give",
        ),
        (walled("far", ("." + "#" * 98 + "W",)), 0, r"far: spans 50.0 x 0.5 m, 40 m to a side"),
        (walled("gate", ("...", ".D.")), 0, r"gate: has a door in the cell \(1, 0\) that is in no wall. Put walls"),
        (plan_of("ell", ELL), -1, r"ell: the seed must be 0 or more, found -1"),
    ],
)
def test_plans_that_are_no_rooms(plan: FloorPlan, seed: int, message: str) -> None:
    with pytest.raises(SceneError, match=message) as caught:
        build_plan_room(plan, seed, looks=False)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_limits_need_no_simulator() -> None:
    assert "mujoco" not in imported_by("import clearway.rooms.plans.buildable")


@dataclass(frozen=True)
class Furnished:
    """A plan with one blocked cell and one blocked edge, its compiled room, and the room coordinates of its cells."""

    plan: FloorPlan
    model: mujoco.MjModel
    data: mujoco.MjData
    places_m: np.ndarray

    def seen_m(self, place_m: np.ndarray, azimuth_deg: float, elevations_deg: np.ndarray) -> float:
        """Distance across the floor to the nearest thing seen from 1 m above a place, in one direction."""
        shown = np.zeros(6, np.uint8)
        shown[SEEN_GROUP] = 1
        azimuth, reached = np.radians(azimuth_deg), [np.inf]
        for elevation in np.radians(elevations_deg):
            flat = np.cos(elevation)
            ray = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])
            hit = np.zeros(1, np.int32)
            distance_m = mujoco.mj_ray(self.model, self.data, np.array([*place_m, 1.0]), ray, shown, 1, -1, hit)
            if hit[0] >= 0 and self.model.geom(int(hit[0])).name != "floor":
                reached.append(distance_m * flat)
        return min(reached)


@pytest.fixture(scope="module")
def furnished() -> Furnished:
    plan = plan_of("ring", ("...", ".#.", "..."), [[[0, 0], [0, 1]]])
    room, layout = build_plan_room(plan)
    model = room.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Furnished(plan, model, data, plan.cells * plan.cell_size_m - np.array(layout.origin_m))


def test_no_camera_stands_in_anything(furnished: Furnished) -> None:
    nearest_m = min(
        furnished.seen_m(place_m, azimuth_deg, np.array([-25.0, 0.0, 25.0]))
        for place_m in furnished.places_m
        for azimuth_deg in range(0, 360, 30)
    )
    assert nearest_m > 0.2  # 0.4 cells; the near plane is at 0.05 m


def test_a_blocked_move_shows_something_close_ahead(furnished: Furnished) -> None:
    plan = furnished.plan
    open_moves = {tuple(edge) for edge in plan.cells[plan.edges].reshape(-1, 4).tolist()}
    blocked = 0
    for (x, z), place_m in zip(plan.cells.tolist(), furnished.places_m, strict=True):
        for heading_deg, (dx, dz) in STEPS.items():
            if (x, z, x + dx, z + dz) in open_moves or (x + dx, z + dz, x, z) in open_moves:
                continue
            blocked += 1
            ahead_m = furnished.seen_m(place_m, 90.0 - heading_deg, np.linspace(-29, 10, 14))
            assert ahead_m < 1.0, (x, z, heading_deg)  # two cells
    assert blocked == 4 * 3 + 4 + 2  # around, around the blocked cell, the edge from both its sides


@pytest.fixture(scope="module")
def two_rooms() -> Furnished:
    plan = walled(areas=(Area("bathroom", (1, 1), (3, 3)), Area("kitchen", (5, 1), (7, 3))))
    room, layout = build_plan_room(plan)
    model = room.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Furnished(plan, model, data, plan.cells * plan.cell_size_m - np.array(layout.origin_m))


def test_a_doorway_shows_with_jambs_and_a_wall_above_it(two_rooms: Furnished) -> None:
    model, data = two_rooms.model, two_rooms.data
    shown = np.array([0, 1, 1, 0, 0, 0], np.uint8)

    def ahead_m(x_m: float, y_m: float, z_m: float) -> float:
        """Distance to what is seen along x from a place of the room."""
        hit = np.zeros(1, np.int32)
        return mujoco.mj_ray(model, data, np.array([x_m, y_m, z_m]), np.array([1.0, 0, 0]), shown, 1, -1, hit)

    # the wall's faces are at x = 1.7 and 2.0 (cells of 0.5 m, the floor starts 0.1 m before them), the door at y = 0.85
    assert ahead_m(1.0, 0.85, 1.0) > 1.5 and ahead_m(1.0, 0.85, 1.95) > 1.5
    assert ahead_m(1.0, 0.85, 2.3) == pytest.approx(0.7, abs=0.01)  # the wall above
    assert ahead_m(1.0, 0.85, 2.08) == pytest.approx(0.7, abs=0.03)  # the architrave
    for jamb_m in (0.85 - 0.33, 0.85 + 0.33):
        assert ahead_m(1.0, jamb_m, 1.0) == pytest.approx(0.7, abs=0.03)
    assert ahead_m(1.0, 1.4, 2.3) == pytest.approx(0.7, abs=0.06)  # the wall beside it


def test_no_camera_stands_in_a_wall_or_a_frame(two_rooms: Furnished) -> None:
    nearest_m = min(
        two_rooms.seen_m(place_m, azimuth_deg, np.array([-25.0, 0.0, 25.0]))
        for place_m in two_rooms.places_m
        for azimuth_deg in range(0, 360, 30)
    )
    assert nearest_m > 0.2


@pytest.mark.slow
def test_both_rooms_are_lit_and_the_way_shows_from_above(two_rooms: Furnished) -> None:
    places_m = two_rooms.places_m[[0, len(two_rooms.places_m) - 1]]
    view = first_person_view(np.repeat(places_m, 4, axis=0), np.tile(list(STEPS), 2))
    pictures = render(two_rooms.model, view, workers=1)
    for picture in pictures.reshape(2, -1):
        assert 70 < picture.mean() < 190
    from_above = np.zeros(6, np.uint8)
    from_above[SEEN_GROUP] = 1
    seen_m = [
        mujoco.mj_ray(
            two_rooms.model, two_rooms.data, np.array([1.85, y_m, 9.0]), np.array([0, 0, -1.0]), from_above, 1, -1, hit
        )
        for y_m, hit in ((0.85, np.zeros(1, np.int32)), (1.4, np.zeros(1, np.int32)))
    ]
    assert seen_m == pytest.approx([9.0, 9.0 - 2.6], abs=0.03)  # the floor of the doorway, the top of the wall


def test_light_and_colours_of_plans_that_name_their_furniture_differ_with_the_seed() -> None:
    lines = ("WWWWWWWW", "W......W", "W.##...W", "WWWWWWWW")
    plain = walled("room", lines)
    named = replace(plain, furniture=(Furnishing("sofa", (2, 1), (3, 1), "north"),))
    rooms = [build_plan_room(named, seed, looks=False)[0] for seed in range(24)]
    assert {room.daytime.name for room in rooms} == {daytime.name for daytime in DAYTIMES}
    assert len({room.colours for room in rooms}) == 24
    again = build_plan_room(named, 3, looks=False)[0]
    assert (again.daytime, again.colours) == (rooms[3].daytime, rooms[3].colours)
    assert {build_plan_room(plain, seed, looks=False)[0].daytime for seed in range(4)} == {NOON}


def real_plans() -> list[FloorPlan]:
    if not REAL_PLANS.is_file():
        pytest.skip(f"the real floor plans are not here: {REAL_PLANS}. Name the file with CLEARWAY_FLOOR_PLANS")
    return [read_floor_plan(REAL_PLANS, name) for name in floor_plan_names(REAL_PLANS)]


@pytest.mark.slow
def test_all_real_plans_come_out_as_given() -> None:
    plans = real_plans()
    assert len(plans) == REAL_PLAN_COUNT
    for plan in plans:
        assert_room_is_the_plan(plan)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["FloorPlan302", "FloorPlan405"])
def test_views_of_real_rooms_differ_and_are_well_lit(name: str) -> None:
    plan = next(plan for plan in real_plans() if plan.name == name)
    room, layout = build_plan_room(plan)
    places_m = (plan.cells * plan.cell_size_m - np.array(layout.origin_m))[::9]
    view = first_person_view(np.repeat(places_m, 4, axis=0), np.tile(list(STEPS), len(places_m)))
    pictures = render(room.spec.compile(), view, workers=1)
    assert len({picture.tobytes() for picture in pictures}) == len(pictures)
    assert 60 < pictures.mean() < 170
