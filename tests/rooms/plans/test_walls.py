"""Walls inside a room, worked out by hand for cells of 1 m: a wall keeps 0.2 m from the cells beside it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.rooms.plans.cell_map import CellMap, cell_map
from clearway.rooms.plans.walls import DOOR_HEIGHT_M, LINING_M, columns_of, doorways_of, faces_of, solid_parts
from clearway.rooms.shell import Column, Face
from clearway.scenes.floor_plans import FloorPlan
from helpers.plan_maps import walled

EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True)
PLAN = walled("two", ("W.W.W", "W.D.W", "W.W.W"))  # 3 x 3 cells, a wall with a door between two rooms


def parts_of(cells: CellMap) -> np.ndarray:
    return solid_parts(cells.solid, ~cells.solid)


def corners(column: Column) -> list[float]:
    return [column.x_min_m, column.y_min_m, column.x_max_m, column.y_max_m]


def ends_m(face: Face) -> list[list[float]]:
    """Both ends of a face on the floor, lower first."""
    points = [face.at.point(x_m, 0, 0)[:2].round(6).tolist() for x_m in (-face.length_m / 2, face.length_m / 2)]
    return sorted(points)


def test_a_wall_of_one_cell_is_thinner_than_it_and_stops_before_the_door() -> None:
    columns = columns_of(parts_of(cell_map(PLAN)), 1.0)
    # the floor starts 0.2 m before the first cell; the wall's cells span x from 1.2 to 2.2
    assert sorted(map(corners, columns)) == pytest.approx(
        [pytest.approx([1.4, 0.0, 2.0, 1.0]), pytest.approx([1.4, 2.4, 2.0, 3.4])]
    )


def test_a_wall_reaches_another_wall_and_keeps_its_distance_from_furniture_too() -> None:
    cells = cell_map(walled("tee", ("....", "WWWW", ".W#.")))
    (top, stem) = sorted(columns_of(parts_of(cells), 1.0), key=lambda column: -column.y_max_m)
    assert corners(top) == pytest.approx([0.0, 1.4, 4.4, 2.0])
    assert corners(stem) == pytest.approx([1.4, 0.0, 2.0, 1.4])


def test_a_doorway_lies_in_its_wall() -> None:
    (doorway,) = doorways_of(cell_map(PLAN), 1.0)
    assert (doorway.at.x_m, doorway.at.y_m, doorway.at.yaw_deg) == pytest.approx((1.7, 1.7, 90.0))
    assert (doorway.width_m, doorway.depth_m) == pytest.approx((1.4, 0.6))


def test_faces_run_straight_on_with_one_above_the_door() -> None:
    cells = cell_map(PLAN)
    faces = [face for face in faces_of(cells, parts_of(cells), 1.0) if face.at.yaw_deg == 90.0]  # look to -x
    low, door, high = sorted(faces, key=lambda face: face.at.y_m)
    assert [ends_m(face) for face in (low, door, high)] == [
        [[1.4, 0.0], [1.4, 1.0]],
        [[1.4, 1.0], [1.4, 2.4]],
        [[1.4, 2.4], [1.4, 3.4]],
    ]
    assert (low.bottom_m, door.bottom_m, high.bottom_m) == (0.0, DOOR_HEIGHT_M + LINING_M, 0.0)
    assert low.ends == (-1, 0)  # its board stops before the board of the outer wall, and runs into the door's frame


def test_the_face_above_a_door_reaches_from_wall_to_wall_either_way() -> None:
    for plan in (PLAN, walled("across", ("...", "WDW", "..."))):
        cells = cell_map(plan)
        above = [face for face in faces_of(cells, parts_of(cells), 1.0) if face.bottom_m]
        assert [face.length_m for face in above] == pytest.approx([1.4, 1.4])


def test_under_the_ceiling_a_face_goes_on_over_the_door() -> None:
    cells = cell_map(PLAN)
    over = faces_of(cells, parts_of(cells), 1.0, under_ceiling=True)
    assert sorted(map(ends_m, over)) == [[[1.4, 0.0], [1.4, 3.4]], [[2.0, 0.0], [2.0, 3.4]]]
    assert all(face.ends == (-1, -1) for face in over)


def test_no_face_shows_in_a_wall_or_behind_a_door_frame() -> None:
    cells = cell_map(PLAN)
    assert {face.at.yaw_deg for face in faces_of(cells, parts_of(cells), 1.0)} == {90.0, -90.0}


def test_boards_meet_at_corners_without_lying_in_each_other() -> None:
    cells = cell_map(walled("stub", ("...", ".W.", "...")))
    ends = {face.at.yaw_deg: face.ends for face in faces_of(cells, parts_of(cells), 1.0)}
    assert ends == {0.0: (1, 1), 180.0: (1, 1), 90.0: (0, 0), -90.0: (0, 0)}


@EXAMPLES
@given(st.lists(st.text(".#W", min_size=5, max_size=5), min_size=1, max_size=6).filter(lambda m: "." in "".join(m)))
def test_faces_enclose_the_columns(lines: list[str]) -> None:
    if "W" not in "".join(lines):
        return
    cells = cell_map(FloorPlan.of_text("any", lines, cell_size_m=1.0))
    parts = parts_of(cells)
    columns = columns_of(parts, 1.0)
    area_m2 = sum((c.x_max_m - c.x_min_m) * (c.y_max_m - c.y_min_m) for c in columns)
    width_m = cells.free.shape[0] + 0.4
    # the sum over the border of x times the outward normal's x is the area; the room's own walls are no faces
    by_faces_m2 = sum(
        face.length_m * {-90.0: face.at.x_m, 90.0: -face.at.x_m}.get(face.at.yaw_deg, 0.0)
        for face in faces_of(cells, parts, 1.0)
    )
    at_east_m = sum(c.y_max_m - c.y_min_m for c in columns if c.x_max_m > width_m - 1e-9)
    assert by_faces_m2 + width_m * at_east_m == pytest.approx(area_m2)
