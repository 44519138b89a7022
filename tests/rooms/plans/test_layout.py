from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clearway.rooms.plans.layout import Layout, Piece, lay_out
from clearway.rooms.plans.walls import GAP, YAWS_DEG
from clearway.rooms.shell import Column
from clearway.scenes.floor_plans import FRONTS, Area, FloorPlan, Furnishing
from helpers.plan_maps import ELL, ISLAND, SINGLE, plan_of, walled

EXAMPLES = settings(max_examples=30, deadline=None, derandomize=True)


WALLED_MAPS = (
    st.integers(1, 7)
    .flatmap(lambda width: st.lists(st.text("..##W", min_size=width, max_size=width), min_size=1, max_size=7))
    .filter(lambda lines: "." in "".join(lines))
)


def laid_out(plan: FloorPlan, seed: int = 0) -> Layout:
    return lay_out(plan, np.random.default_rng(seed))


def rectangle_of(piece: Piece) -> np.ndarray:
    """Lowest and highest corner, (2, 2), of a piece's footprint."""
    along_x_m, along_y_m = (
        (piece.width_m, piece.depth_m) if piece.at.yaw_deg % 180 == 0 else (piece.depth_m, piece.width_m)
    )
    half = np.array([along_x_m, along_y_m]) / 2
    middle = np.array([piece.at.x_m, piece.at.y_m])
    return np.array([middle - half, middle + half])


def column_of(column: Column) -> np.ndarray:
    return np.array([[column.x_min_m, column.y_min_m], [column.x_max_m, column.y_max_m]])


def places_m(plan: FloorPlan, layout: Layout) -> np.ndarray:
    """Room coordinates of the plan's cells."""
    return plan.cells * plan.cell_size_m - np.array(layout.origin_m)


def distances_m(points_m: np.ndarray, rectangles: np.ndarray) -> np.ndarray:
    """Larger of the distances along x and y from each point to each rectangle, (points, rectangles); 0 inside."""
    low, high = rectangles[None, :, 0], rectangles[None, :, 1]
    points_m = points_m[:, None]
    return np.maximum(np.maximum(low - points_m, points_m - high), 0).max(axis=2)


def test_a_wide_notch_is_wall_and_an_island_is_furniture() -> None:
    ell, island = laid_out(plan_of("ell", ELL)), laid_out(plan_of("island", ISLAND))
    assert len(ell.walls) > 0 and len(island.walls) == 0
    corner = places_m(plan_of("ell", ELL), ell).max(axis=0)  # of the notch's far end
    covered = distances_m(corner[None], np.array([column_of(wall) for wall in ell.walls]))
    assert covered.min() == 0
    middle_m = places_m(plan_of("island", ISLAND), island).mean(axis=0)
    table = min(island.pieces, key=lambda piece: np.hypot(piece.at.x_m - middle_m[0], piece.at.y_m - middle_m[1]))
    assert (table.at.x_m, table.at.y_m) == pytest.approx(tuple(middle_m))
    # 2 x 2 cells of 0.5 m, drawn in by 0.2 cells on every side
    assert (table.width_m, table.depth_m, table.back_at_wall) == (pytest.approx(0.8), pytest.approx(0.8), False)


def test_a_blocked_edge_becomes_a_partition_on_the_border() -> None:
    plan = plan_of("island", ISLAND, [[[0, 0], [1, 0]], [[5, 2], [5, 1]]])
    layout = laid_out(plan)
    first_m, last_m = places_m(plan, layout)[0], places_m(plan, layout).max(axis=0)
    across, along = (column_of(partition) - first_m for partition in layout.partitions)
    assert across == pytest.approx(np.array([[0.225, -0.25], [0.275, 0.25]]))  # 5 cm thick, as long as a cell
    low, high = along + first_m
    assert (low + high) / 2 == pytest.approx([last_m[0], first_m[1] + 0.75])
    assert high - low == pytest.approx([0.5, 0.05])
    assert all(partition.top_m is not None and 1.0 < partition.top_m < 1.5 for partition in layout.partitions)


def test_one_cell_is_a_room_with_furniture() -> None:
    layout = laid_out(plan_of("single", SINGLE))
    assert layout.free.sum() == 1 and len(layout.pieces) >= 2
    assert (
        1.2 - 1e-9 <= layout.width_m <= 1.7 + 1e-9
    )  # the cell, 0.5 m of furniture on one side or both, 0.2 m to the walls


def test_furniture_faces_the_free_cells_with_its_back_to_the_wall() -> None:
    plan = plan_of("row", ("....",))
    layout = laid_out(plan)
    row_m = places_m(plan, layout)[0, 1]
    behind = [piece for piece in layout.pieces if piece.at.y_m > row_m + 0.3 and piece.width_m > 0.6]
    before = [piece for piece in layout.pieces if piece.at.y_m < row_m - 0.3 and piece.width_m > 0.6]
    assert behind or before
    assert all(piece.at.yaw_deg == 180 and piece.back_at_wall for piece in behind)
    assert all(piece.at.yaw_deg == 0 and piece.back_at_wall for piece in before)


def test_stretches_lie_on_the_walls_of_the_room() -> None:
    layout = laid_out(plan_of("ell", ELL))
    outer = [stretch for stretch in layout.stretches if stretch.outer]
    assert sum(stretch.length_m for stretch in outer) > 6
    for stretch in outer:
        wall_m = stretch.at.point(0, 0, 0)[:2]
        gaps = [*wall_m, layout.width_m - wall_m[0], layout.depth_m - wall_m[1]]
        assert min(np.abs(gaps)) < 1e-9
        inside_m = stretch.at.point(0, 0.1, 0)[:2]
        assert (inside_m > 0).all() and (inside_m < [layout.width_m, layout.depth_m]).all()
    assert any(not stretch.outer and stretch.piece is None for stretch in layout.stretches)  # the notch's sides


@EXAMPLES
@given(
    arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.booleans()).filter(np.any),
    st.integers(0, 9),
    st.sampled_from([0.25, 0.5, 1.3]),
)
def test_everything_keeps_its_distance_and_every_blocked_cell_is_covered(reachable, seed, cell_size_m) -> None:
    plan = FloorPlan.of_map("any", reachable, cell_size_m=cell_size_m)
    layout = laid_out(plan, seed)
    solids = np.array([*map(column_of, layout.walls), *map(rectangle_of, layout.pieces)])
    nearest_m = (0.5 + GAP) * cell_size_m
    places = places_m(plan, layout)
    beside = distances_m(places, solids)
    # beside a corner, what stands diagonally ahead may come as near as the border of the cell
    assert beside.min() > 0.5 * cell_size_m
    straight = [
        beside[row, number]
        for row, place in enumerate(places)
        for number, (low, high) in enumerate(solids)
        if ((low < place) & (place < high)).any()
    ]
    assert min(straight, default=nearest_m) >= nearest_m - 1e-9
    assert (places >= nearest_m - 1e-9).all()
    assert (places <= [layout.width_m - nearest_m + 1e-9, layout.depth_m - nearest_m + 1e-9]).all()
    blocked = layout.middles_m(np.argwhere(~layout.free))
    assert (distances_m(blocked, solids).min(axis=1) == 0).all()
    assert layout.free.sum() == len(plan.cells)


def test_a_plan_with_walls_has_furniture_where_it_says_and_no_rim() -> None:
    plan = walled()
    layout = laid_out(plan)
    # 7 x 3 cells of 0.5 m inside the walls, 0.2 cells to them
    assert (layout.width_m, layout.depth_m) == pytest.approx((3.7, 1.7))
    assert layout.origin_m == pytest.approx((0.15, 0.15)) and layout.first_cell == (1, 1)
    low, high = sorted(layout.pieces, key=lambda piece: piece.at.y_m)
    # two cells before the outer wall and the inner one, 0.1 m beyond them up to the walls and 0.1 m off the free cells
    assert rectangle_of(low) == pytest.approx(np.array([[0.7, 0.0], [1.7, 0.5]]))
    assert (low.room, high.room) == (1, 2) and low.back_at_wall and high.back_at_wall


def test_furniture_knows_a_wall_inside_behind_it() -> None:
    layout = laid_out(walled("den", ("......", "......", "WWWW..", "..#W..", "......")))
    (piece,) = layout.pieces
    assert piece.back_at_wall and piece.at.yaw_deg in (90.0, 180.0)


def test_pictures_may_hang_on_walls_inside_but_not_in_doorways_and_windows_only_outside() -> None:
    layout = laid_out(walled())
    inner = [stretch for stretch in layout.stretches if not stretch.outer]
    at_wall = sorted((round(s.at.x_m, 6), round(s.at.y_m, 6), round(s.length_m, 6), s.room, s.piece) for s in inner)
    # the wall's faces are at x = 1.7 and 2.0; beside the door 0.1 m and 0.1 m of frame are left out
    assert [row[:2] for row in at_wall] == [(1.7, 0.25), (1.7, 1.45), (2.0, 0.25), (2.0, 1.45)]
    assert all(row[2] == pytest.approx(0.3) for row in at_wall)
    assert [row[3] for row in at_wall] == [1, 1, 2, 2] and [row[4] is None for row in at_wall] == [0, 1, 1, 0]


def test_a_wall_drawn_around_a_notch_is_an_outer_wall() -> None:
    layout = laid_out(walled("ell", ("WWWWWWW", "W..WWWW", "W.....W", "WWWWWWW")))
    assert all(stretch.outer for stretch in layout.stretches)


def test_pieces_and_stretches_know_their_area_and_areas_meet_in_the_wall() -> None:
    areas = (Area("kitchen", (1, 1), (3, 3)), Area("bathroom", (5, 1), (7, 3)))
    layout = laid_out(walled(areas=areas))
    assert [piece.area for piece in sorted(layout.pieces, key=lambda piece: piece.at.x_m)] == list(areas)
    assert {stretch.area for stretch in layout.stretches} == set(areas)
    x_m = np.array([0.0, 1.7, 1.8, 1.9, 2.0, 3.7])  # the wall's cells span 1.6 to 2.1
    assert layout.area_at(x_m, np.full(6, 0.2)).tolist() == [0, 0, 0, 1, 1, 1]
    assert (laid_out(walled()).area_map == -1).all()


@EXAMPLES
@given(WALLED_MAPS, st.integers(0, 9), st.sampled_from([0.25, 0.5, 1.3]))
def test_walls_and_furniture_fill_what_is_not_free_and_nothing_lies_in_another(lines, seed, cell_size_m) -> None:
    plan = FloorPlan.of_text("any", lines, cell_size_m=cell_size_m)
    if not plan.has_walls:
        return
    layout = laid_out(plan, seed)
    solids = np.array([*map(column_of, layout.walls), *map(rectangle_of, layout.pieces)]).reshape(-1, 2, 2)
    blocked = layout.middles_m(np.argwhere(~layout.free))
    assert (distances_m(blocked, solids).min(axis=1, initial=np.inf) == 0).all()
    for number, (low, high) in enumerate(solids):
        overlap_m = np.minimum(high, solids[:, 1]) - np.maximum(low, solids[:, 0])
        overlap_m[number] = -1
        assert (overlap_m.min(axis=1) < 1e-9).all()


def test_rooms_of_plans_without_walls_stay_as_they_were() -> None:
    layout = laid_out(plan_of("ell", ELL), 5)
    numbers = [[piece.at.x_m, piece.at.y_m, piece.at.yaw_deg, piece.width_m, piece.depth_m] for piece in layout.pieces]
    assert np.sum(np.round(numbers, 6), axis=0) == pytest.approx([12.955, 11.105, 90.0, 9.69, 4.09])
    assert not layout.faces and not layout.doorways and {piece.room for piece in layout.pieces} == {0}


def test_the_seed_chooses_the_walls_with_furniture() -> None:
    plan = plan_of("island", ISLAND)
    assert laid_out(plan, 3).pieces == laid_out(plan, 3).pieces
    assert len({laid_out(plan, seed).free.shape for seed in range(12)}) > 1


def test_what_is_outside_of_a_flat_is_told_from_its_walls() -> None:
    lines = ("WWWWWWW", "W.WWWWW", "W.WWWWW", "W.WWWWW", "W.....W", "WWWWWWW")
    layout = laid_out(walled("ell", lines))
    assert layout.beyond and set(layout.beyond) < set(layout.walls)
    # cells of 0.5 m; the wall of one cell beside the rooms ends 1.1 m and 1.1 m from the corner of the floor
    low = np.min([column_of(column)[0] for column in layout.beyond], axis=0)
    assert low == pytest.approx([1.1, 1.1])
    assert not laid_out(plan_of("ell", ELL)).beyond


@pytest.mark.parametrize("front", FRONTS)
def test_furniture_that_a_plan_names_stands_on_its_cells_and_looks_where_it_says(front: str) -> None:
    lines = ("WWWWWW", "W....W", "W.##.W", "W.##.W", "W....W", "WWWWWW")
    plan = replace(walled("one", lines), furniture=(Furnishing("sofa", (2, 2), (3, 3), front),))
    (piece,) = laid_out(plan).pieces
    assert piece.kind == "sofa" and piece.at.yaw_deg == YAWS_DEG[front]
    # cells 2 and 3 of 0.5 m begin 0.6 m from the floor's corner, and the piece keeps 0.1 m from what is free
    assert rectangle_of(piece) == pytest.approx(np.array([[0.7, 0.7], [1.5, 1.5]]))
    (unnamed,) = laid_out(walled("one", lines)).pieces
    assert unnamed.kind is None and rectangle_of(unnamed) == pytest.approx(rectangle_of(piece))


def test_furniture_is_not_cut_and_what_is_beside_it_is() -> None:
    lines = ("WWWWWWWWWWWW", "W##########W", "W..........W", "WWWWWWWWWWWW")
    counter = Furnishing("counter", (1, 2), (7, 2), "south")
    pieces = laid_out(replace(walled("row", lines), furniture=(counter,))).pieces
    named = [piece for piece in pieces if piece.kind == "counter"]
    assert len(named) == 1 and named[0].width_m == pytest.approx(7 * 0.5 + 0.1 - 0.01)
    assert {piece.kind for piece in pieces} == {"counter", None}
