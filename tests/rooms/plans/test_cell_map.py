import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.rooms.plans.cell_map import Opening, cell_map
from clearway.scenes.floor_plans import FloorPlan
from helpers.imported import imported_by
from helpers.plan_maps import walled


def drawn(marked: np.ndarray) -> list[str]:
    """A map (X, Z) of numbers as lines seen from above; 0 is a point."""
    return ["".join("." if number == 0 else str(int(number)) for number in row) for row in marked.T[::-1]]


def test_two_rooms_without_the_walls_around_them() -> None:
    cells = cell_map(walled())
    assert cells.first_cell == (1, 1)
    assert drawn(cells.free) == ["111...1", "1111111", "1...111"]
    assert drawn(cells.solid) == ["...1...", ".......", "...1..."]
    assert drawn(cells.rooms) == ["111...2", "111.222", "1...222"]
    assert cells.openings == (Opening((3, 1, 4, 2), along_x=False),)


def test_what_no_free_cell_looks_at_is_wall() -> None:
    lines = ("W....WW", "WWWWWW#", "W##WWW#", "W##W...", "WWWW#..")
    assert drawn(cell_map(walled("shaft", lines)).solid) == ["....11", "11111.", "11111.", "111...", "111..."]


def test_a_wide_blocked_part_inside_walls_is_furniture() -> None:
    inside = cell_map(walled("bed", ("WWWWWWW", "W###..W", "W###..W", "W###..W", "WWWWWWW")))
    assert drawn(inside.solid) == ["....."] * 3
    open_to_border = cell_map(walled("notch", ("###...W", "###...W", "###...W", "......W")))
    assert drawn(open_to_border.solid) == ["111...", "111...", "111...", "......"]


def test_doors_side_by_side_are_one_opening_and_a_thick_wall_has_one() -> None:
    wide = cell_map(walled("wide", ("....", "WDDW", "....")))
    assert wide.openings == (Opening((1, 1, 3, 2), True),)
    thick = cell_map(walled("thick", ("...", "WDW", "WDW", "...")))
    assert thick.openings == (Opening((1, 1, 2, 3), True),)


def test_the_border_of_a_map_is_wall_beside_a_door() -> None:
    assert cell_map(walled("edge", ("..", "DW", ".."))).openings == (Opening((0, 1, 1, 2), True),)


def test_a_door_between_walls_on_all_sides_leads_where_one_can_walk() -> None:
    dead_end = walled("nook", ("WWWW", "W.DW", "WWWW"))
    assert cell_map(dead_end).openings == (Opening((1, 0, 2, 1), False),)


@pytest.mark.parametrize(
    "lines",
    [
        ("...", ".D.", "..."),
        ("W..", "WD.", "W.."),
        ("#D#", "..."),
        ("WDW", "DD.", "..."),
        ("W..W", "WDWW", "WDDW", "W..W"),
    ],
)
def test_a_door_in_no_wall_is_refused(lines: tuple[str, ...]) -> None:
    plan = FloorPlan.of_text("flat", lines, source="flat.txt")
    with pytest.raises(SceneError, match=r"^flat.txt: has a door in the cell \(\d, \d\) that is in no wall. Put walls"):
        cell_map(plan)


def test_maps_need_no_simulator() -> None:
    assert "mujoco" not in imported_by("import clearway.rooms.plans.cell_map")
