"""Layouts of the small room: what can be moved, what stays free, where a new obstacle goes."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.live.arrangement import (
    Arrangement,
    arranged,
    as_built,
    furniture_moved,
    shortest_path,
    way_remains,
    with_obstacle_on_path,
)
from clearway.rooms.navigation import find_grid
from clearway.rooms.pieces import loose_obstacles
from clearway.rooms.plans.plan_room import agent_for, build_plan_room
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Provenance, Scene
from helpers.small_live import state_at, walkable_room
from helpers.small_rooms import SmallRoom


@pytest.fixture(scope="module")
def ends(live) -> tuple[int, int]:
    return state_at(live.scene, 0.25, 0.25, 0), state_at(live.scene, 0.25, 2.25, 0)


def test_as_built_has_the_grid_of_the_scene(live):
    grid = find_grid(arranged(live.room, as_built(live.room)))
    np.testing.assert_array_equal(grid.graph, live.scene.graph)


def test_a_moved_piece_blocks_other_cells(live):
    layout = as_built(live.room).with_piece(0, (0.5, 0.0))
    before, after = live.scene.locations_m[::4], find_grid(arranged(live.room, layout)).locations_m
    assert [0.75, 0.75] not in before.tolist() and [0.75, 0.75] in after.tolist()
    assert [1.25, 0.75] in before.tolist() and [1.25, 0.75] not in after.tolist()


def test_bodies_of_a_layout_are_its_pieces_and_the_new_obstacle_out_of_sight_or_on_the_floor():
    layout = Arrangement(((0.1, 0.2), (0.0, 0.0)))
    assert layout.bodies_m == ((0.1, 0.2, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -10.0))
    assert Arrangement((), (1.0, 2.0)).bodies_m == ((1.0, 2.0, 0.0),)


def test_the_new_obstacle_stands_on_the_shortest_path_and_leaves_a_way(live, ends):
    assert len(shortest_path(live.scene, *ends)) == 5  # four moves along the wall
    for seed in range(5):
        layout = with_obstacle_on_path(live.room, live.scene, as_built(live.room), *ends, np.random.default_rng(seed))
        assert layout.new_m is not None
        x_m, z_m = layout.new_m
        assert x_m == 0.25 and z_m in (0.75, 1.25, 1.75)
        assert way_remains(live.room, live.scene, layout, *ends)
        assert [x_m, z_m] not in find_grid(arranged(live.room, layout)).locations_m.tolist()


def test_there_is_no_new_obstacle_where_there_is_no_other_way():
    room = SmallRoom(width_m=0.5)
    corridor = bare_scene(room)
    assert corridor.cell_count == 4
    layout = with_obstacle_on_path(room, corridor, as_built(room), 0, 12, np.random.default_rng(0))
    assert layout.new_m is None


def bare_scene(room: SmallRoom) -> Scene:
    """The room's grid without pictures."""
    grid = find_grid(room)
    return Scene(
        name=room.name,
        observations=None,
        features=None,
        locations_m=grid.state_locations_m,
        headings_deg=grid.state_headings_deg,
        graph=grid.graph,
        made_by=Provenance("test"),
    )


def test_a_piece_of_a_plan_is_moved_as_a_whole():
    plan = generated_plan(Request("room", "test", 0, 0))
    scene, (room, at) = floor_plan_scene(plan, feature_count=4), build_plan_room(plan, looks=False)
    moved = replace(scene, locations_m=scene.locations_m - np.array(at.origin_m))
    start, target = np.flatnonzero(scene.components == 0)[[0, -1]].tolist()
    layout = furniture_moved(room, moved, start, target, 0.3, np.random.default_rng(0), agent_for(plan.cell_size_m))
    offsets = defaultdict(list)
    for before, after in zip(*(loose_obstacles(one.spec) for one in (room, arranged(room, layout))), strict=True):
        offsets[before.name.partition("/")[0]].append(after.pos[:2] - before.pos[:2])
    assert len(layout.moved_m) == len(offsets) > 2 and all(name.startswith("piece") for name in offsets)
    assert any(np.hypot(*offset) > 0.01 for offset in layout.moved_m)
    assert all(len(own) > 1 for own in offsets.values())
    for own, offset_m in zip(offsets.values(), layout.moved_m, strict=True):
        np.testing.assert_allclose(own, [offset_m] * len(own), atol=1e-9)


def test_furniture_that_would_run_into_something_stays(ends, live):
    room = walkable_room()
    assert len(loose_obstacles(room.spec)) == 2
    for seed in range(10):
        layout = furniture_moved(room, live.scene, *ends, 0.3, np.random.default_rng(seed))
        model = arranged(room, layout).spec.compile()
        assert model.ngeom == 2
        assert way_remains(room, live.scene, layout, *ends)
    hemmed_in = SmallRoom().add_box((0.95, 1.05), (0.95, 1.05))
    for x_m, z_m in (((0.5, 0.95), (0.5, 1.5)), ((1.05, 1.5), (0.5, 1.5)), ((0.9, 1.1), (0.5, 0.95))):
        hemmed_in.add_box(x_m, z_m, (0.5, 1.0))  # begins above the floor, so that it stays
    hemmed_in.add_box((0.9, 1.1), (1.05, 1.5), (0.5, 1.0))
    corner = bare_scene(hemmed_in)
    for seed in range(5):
        layout = furniture_moved(hemmed_in, corner, 0, 4, 0.3, np.random.default_rng(seed))
        assert np.hypot(*layout.moved_m[0]) < 0.001
