"""Where the agent fits in MuJoCo models: typed-in mazes, and one of our own rooms taken through an MJCF file."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.importers.mjcf_floor import FloorChoice, find_cells, floor_of
from clearway.rooms import build_room
from clearway.rooms.navigation import NavigationGrid, find_grid
from clearway.rooms.obstacles import AgentShape, add_body

PATH = Path("maze.xml")
ENDLESS_FLOOR = '<geom type="plane" size="0 0 1"/>'
WALLS = """
  <geom type="box" size="1.05 .05 1" pos=".75 -.3 1"/>
  <geom type="box" size="1.05 .05 1" pos=".75 1.3 1"/>
  <geom type="box" size=".05 .75 1" pos="-.3 .5 1"/>
  <geom type="box" size=".05 .75 1" pos="1.8 .5 1"/>
"""  # around 4 x 3 cells of 0.5 m, whose centres are x = 0 to 1.5 and z = 0 to 1


def model_of(words: str) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(f"<mujoco>{words}</mujoco>")
    add_body(spec, AgentShape())
    return spec.compile()


def grid_of(model: mujoco.MjModel, world: FloorChoice) -> NavigationGrid:
    agent, data = AgentShape(), mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return find_cells(PATH, model, data, floor_of(PATH, model, data, world, agent.step_m), world, agent)


def found(words: str, world: FloorChoice | None = None) -> NavigationGrid:
    return grid_of(model_of(f"<worldbody>{words}</worldbody>"), world or FloorChoice())


def places(grid: NavigationGrid) -> list[tuple[float, float]]:
    return [(float(x), float(z)) for x, z in grid.locations_m.round(9)]


def ways(grid: NavigationGrid) -> set[tuple[tuple[float, float], tuple[float, float]]]:
    there = places(grid)
    return {(there[near], there[far]) for near, far in grid.edges.tolist()}


FULL = [(x, z) for x in (0.0, 0.5, 1.0, 1.5) for z in (0.0, 0.5, 1.0)]


def test_an_empty_room_is_full_of_cells() -> None:
    grid = found(ENDLESS_FLOOR + WALLS)
    assert places(grid) == FULL
    assert len(grid.edges) == 3 * 3 + 4 * 2


def test_a_maze_has_the_cells_and_moves_that_are_typed_in() -> None:
    post = '<geom type="cylinder" size=".05 .5" pos=".5 .5 .5"/>'
    screen = '<geom type="box" size=".01 .2 .5" pos="1.25 0 .5"/>'
    hung = '<geom type="box" size=".1 .1 .1" pos="0 0 1.8"/>'  # above the head
    mat = '<geom type="box" size=".2 .2 .005" pos="0 .5 .005"/>'  # walked over
    grid = found(ENDLESS_FLOOR + WALLS + post + screen + hung + mat)
    assert places(grid) == [place for place in FULL if place != (0.5, 0.5)]
    full = ways(found(ENDLESS_FLOOR + WALLS))
    blocked = {way for way in full if (0.5, 0.5) in way} | {((1.0, 0.0), (1.5, 0.0))}
    assert ways(grid) == full - blocked


def test_one_of_our_own_rooms_keeps_its_cells_and_moves_through_a_file() -> None:
    room = build_room("bathroom", looks=False)
    expected = find_grid(room)
    room.spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    spec = mujoco.MjSpec.from_string(room.spec.to_xml())
    add_body(spec, AgentShape())
    x_m, z_m = expected.locations_m[0]
    world = FloorChoice(spawn_m=(float(x_m), float(z_m)), extent_m=(0.0, room.width_m, 0.0, room.depth_m))
    grid = grid_of(spec.compile(), world)
    np.testing.assert_allclose(grid.locations_m, expected.locations_m, atol=1e-6)
    np.testing.assert_array_equal(grid.graph, expected.graph)


def test_what_collides_with_nothing_is_only_seen_unless_asked() -> None:
    ghost = '<geom type="box" size=".05 .05 1" pos=".5 .5 1" contype="0" conaffinity="0"/>'
    assert len(found(ENDLESS_FLOOR + WALLS + ghost).cells) == 12
    assert len(found(ENDLESS_FLOOR + WALLS + ghost, FloorChoice(unfelt_too=True)).cells) == 11


def test_bodies_stand_where_the_model_starts() -> None:
    turned = """<body pos="0 0 .5"><joint type="hinge" axis="0 0 1"/><geom type="box" size=".05 .05 .4" pos="1 1 0"/>
        </body>"""
    assert (1.0, 1.0) not in places(found(ENDLESS_FLOOR + WALLS + turned))


def test_meshes_block_their_convex_hull() -> None:
    corners = "0 0 0  .1 0 0  0 .1 0  0 0 .5"
    asset = f'<asset><mesh name="spike" vertex="{corners}"/></asset>'
    words = f'{asset}<worldbody>{ENDLESS_FLOOR}{WALLS}<geom type="mesh" mesh="spike" pos=".5 .5 0"/></worldbody>'
    # MuJoCo puts a mesh's frame to its centre, and back by the geom's place
    assert len(grid_of(model_of(words), FloorChoice()).cells) == 11


def test_a_plane_that_stands_is_a_wall() -> None:
    wall = '<geom type="plane" size="0 0 1" zaxis="-1 0 0" pos="1.25 0 0"/>'  # all beyond x = 1.25 is solid
    assert places(found(ENDLESS_FLOOR + WALLS + wall)) == [place for place in FULL if place[0] < 1.25]


def test_the_agent_stands_on_floors_only() -> None:
    slabs = '<geom type="box" size="1.05 .5 .1" pos=".75 .2 -.1"/>'  # from z = -0.3 to 0.7
    assert places(found(slabs + WALLS)) == [place for place in FULL if place[1] < 0.7]
    with pytest.raises(SceneError, match="fits nowhere on a floor at a height of 0 m"):
        found(WALLS)


def test_the_agent_does_not_move_across_a_ditch() -> None:
    slabs = """
      <geom type="box" size=".475 .8 .1" pos=".225 .5 -.1"/>
      <geom type="box" size=".475 .8 .1" pos="1.275 .5 -.1"/>
      <geom type="box" size=".05 .275 .1" pos=".75 1.025 -.1"/>
    """  # a ditch at x = 0.7 to 0.8 between cells, with a bridge at z = 1
    grid = found(slabs + WALLS)
    assert places(grid) == FULL
    assert ways(found(ENDLESS_FLOOR + WALLS)) - ways(grid) == {((0.5, z), (1.0, z)) for z in (0.0, 0.5)}


@pytest.mark.parametrize(("lower_m", "columns"), [(0.09, [0.0, 0.5, 1.0, 1.5]), (0.11, [0.0, 0.5, 1.0])])
def test_a_floor_counts_down_to_0_1_m_below_the_height_given(lower_m: float, columns: list[float]) -> None:
    floor = '<geom type="box" size=".75 .8 .1" pos=".45 .5 -.1"/>'  # up to x = 1.2
    step = f'<geom type="box" size=".3 .8 .1" pos="1.5 .5 {-0.1 - lower_m}"/>'
    assert places(found(floor + step + WALLS)) == [place for place in FULL if place[0] in columns]


def test_a_floor_may_lie_at_any_height() -> None:
    storey = '<geom type="box" size="1.05 .8 .1" pos=".75 .5 2.9"/>'
    post = '<geom type="cylinder" size=".05 .5" pos=".5 .5 3.5"/>'
    grid = found(ENDLESS_FLOOR + WALLS + storey + post, FloorChoice(floor_m=3.0))
    assert places(grid) == [place for place in FULL if place != (0.5, 0.5)]


def test_the_spawn_point_sets_the_grid_and_the_part() -> None:
    divider = '<geom type="box" size=".05 1 1" pos="1.15 .5 1"/>'  # no room at x = 1
    assert len(found(ENDLESS_FLOOR + WALLS + divider).cells) == 6  # x = 0 and 0.5
    grid = found(ENDLESS_FLOOR + WALLS + divider, FloorChoice(spawn_m=(1.5, 0.25)))
    assert places(grid) == [(1.5, 0.25), (1.5, 0.75)]
    with pytest.raises(SceneError, match=r"fits not at the spawn point \(1\.15, 0\)"):
        found(ENDLESS_FLOOR + WALLS + divider, FloorChoice(spawn_m=(1.15, 0.0)))


def test_a_floor_reaches_as_far_as_finite_geoms_or_as_said() -> None:
    drawn = '<geom type="plane" size=".8 .55 1" pos=".5 .25 0"/>'  # x from -0.3 to 1.3, z from -0.3 to 0.8
    assert places(found(drawn)) == [place for place in FULL if place[0] < 1.3 and place[1] < 0.8]
    assert len(found(ENDLESS_FLOOR, FloorChoice(extent_m=(-0.3, 1.3, -0.3, 0.8))).cells) == 6
    with pytest.raises(SceneError, match=r"no geom of a finite size\. .*--extent"):
        found(ENDLESS_FLOOR)


@pytest.mark.parametrize(
    ("extent_m", "problem"),
    [
        ((0.0, 900.0, 0.0, 900.0), "3,243,601 places to try, expected at most 262,144"),
        ((0.0, 1e5, 0.0, 1.0), "numbers up to 10,000"),
        ((1.0, 0.0, 0.0, 1.0), "lengths above 0"),
        ((0.0, float("nan"), 0.0, 1.0), "lengths above 0"),
        ((0.0, float("inf"), 0.0, 1.0), "numbers up to 10,000"),
    ],
)
def test_a_world_too_large_is_refused_before_any_work(
    extent_m: tuple[float, float, float, float], problem: str
) -> None:
    with pytest.raises(SceneError, match=problem):
        found(ENDLESS_FLOOR, FloorChoice(extent_m=extent_m))
    far = '<geom type="sphere" size="1" pos="5000 5000 0"/>'
    with pytest.raises(SceneError, match=r"maze\.xml: its floor spans .* places to try.*--extent"):
        found(ENDLESS_FLOOR + WALLS + far)


@pytest.mark.parametrize("spawn_m", [(9.0, 0.0), (float("nan"), 0.0), (0.0, float("inf"))])
def test_a_spawn_point_off_the_floor_is_refused(spawn_m: tuple[float, float]) -> None:
    with pytest.raises(SceneError, match=r"not to the spawn point \(.*--spawn"):
        found(ENDLESS_FLOOR + WALLS, FloorChoice(spawn_m=spawn_m))


def test_no_cell_where_the_floor_is_smaller_than_the_agent() -> None:
    with pytest.raises(SceneError, match="fits nowhere"):
        found(ENDLESS_FLOOR, FloorChoice(extent_m=(0.1, 0.2, 0.1, 0.2)))
