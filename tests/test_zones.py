import numpy as np
import pytest

from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.scene import Scene
from clearway.zones import ZONE_NAMES, Zone, cell_zones, pose_zones, scene_zones
from helpers.made import corridor_scene, grid_scene, scene_of_cells

F, P, C = Zone.FREE, Zone.PRECOLLISION, Zone.COLLISION

# An L-shaped room seen from above, +z upwards: its corner is at the lower left.
L_ROOM = """
###
###
#####
#####
#####
"""
L_LOOKING_ALONG_Z = """
CCC
PPP
FFFCC
PPPPP
CCCCC
"""
L_LOOKING_ALONG_X = """
CPC
CPC
CPFPC
CPFPC
CPFPC
"""
L_CELLS = """
CCC
CPC
CPPCC
CPPPC
CCCCC
"""


def drawn(drawing: str) -> dict[tuple[int, int], str]:
    """The letter of each cell (x, z) of a drawing."""
    rows = drawing.strip().splitlines()
    return {(x, z): letter for z, row in enumerate(reversed(rows)) for x, letter in enumerate(row) if letter != " "}


def room(drawing: str) -> Scene:
    return scene_of_cells(np.array(sorted(drawn(drawing))))


def zones_by_cell(scene: Scene, zones: np.ndarray, headings: tuple[int, ...]) -> dict[tuple[int, int], set[str]]:
    """The letters of the zones that the poses of a cell with these headings are in."""
    found: dict[tuple[int, int], set[str]] = {}
    for location, heading, zone in zip(scene.locations_m, scene.headings_deg, zones, strict=True):
        if heading in headings:
            x, z = np.round(location / scene.cell_size_m).astype(int).tolist()
            found.setdefault((x, z), set()).add(ZONE_NAMES[zone][0].upper())
    return found


def test_corridor_by_pose() -> None:
    zones = pose_zones(corridor_scene(5).graph).reshape(5, 4)  # [cell, heading / 90]
    assert zones.dtype == np.int8
    assert zones.tolist() == [
        [C, C, C, C],
        [P, C, P, C],
        [F, C, F, C],
        [P, C, P, C],
        [C, C, C, C],
    ]


def test_corridor_by_cell_is_all_collision() -> None:
    scene = corridor_scene(5)
    assert (cell_zones(scene.graph, scene.cells) == C).all()


@pytest.mark.parametrize(
    ("headings", "expected"),
    [((0, 180), L_LOOKING_ALONG_Z), ((90, 270), L_LOOKING_ALONG_X)],
    ids=["along z", "along x"],
)
def test_l_shaped_room_by_pose(headings: tuple[int, int], expected: str) -> None:
    scene = room(L_ROOM)
    found = zones_by_cell(scene, scene_zones(scene), headings)
    assert found == {cell: {letter} for cell, letter in drawn(expected).items()}


def test_l_shaped_room_by_cell() -> None:
    scene = room(L_ROOM)
    found = zones_by_cell(scene, scene_zones(scene, "cell"), (0, 90, 180, 270))
    assert found == {cell: {letter} for cell, letter in drawn(L_CELLS).items()}


def test_the_middle_of_a_square_room_is_free_by_cell() -> None:
    scene = room("\n".join(["#####"] * 5))
    found = zones_by_cell(scene, scene_zones(scene, "cell"), (0, 90, 180, 270))
    assert found == {cell: {letter} for cell, letter in drawn("CCCCC\nCPPPC\nCPFPC\nCPPPC\nCCCCC").items()}


def test_blocked_turns_make_no_zone() -> None:
    graph = room("\n".join(["#####"] * 5)).graph.copy()
    before = pose_zones(graph)
    graph[:, [Action.TURN_LEFT, Action.TURN_RIGHT]] = BLOCKED
    assert np.array_equal(pose_zones(graph), before)


@pytest.mark.parametrize("seed", range(3))
def test_cell_zones_are_at_least_as_near_as_pose_zones(seed: int) -> None:
    scene = grid_scene(seed)
    assert (scene_zones(scene, "cell") >= scene_zones(scene, "pose")).all()
