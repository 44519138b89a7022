from __future__ import annotations

import mujoco
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.rooms.navigation import find_grid
from clearway.rooms.obstacles import AgentShape
from clearway.scenes.actions import Action
from helpers.small_rooms import SmallRoom


def edge_set(grid) -> set:
    return {tuple(map(tuple, grid.cells[edge].tolist())) for edge in grid.edges}


def test_empty_room_is_a_full_grid():
    grid = find_grid(SmallRoom())
    assert len(grid.cells) == 16
    assert len(grid.edges) == 24
    assert grid.component_sizes == (16,)
    assert grid.locations_m[:5].tolist() == [
        [0.25, 0.25],
        [0.25, 0.75],
        [0.25, 1.25],
        [0.25, 1.75],
        [0.75, 0.25],
    ]
    assert grid.smallest_margin_m == pytest.approx(0.04)  # 0.25 - 0.2 radius - 0.01 clearance
    assert (len(grid.edges), len(grid.cells)) == (24, 16)


def test_the_grid_starts_at_its_origin_whatever_multiple_of_the_step_is_given():
    near = find_grid(SmallRoom(grid_origin_m=(0.5, 0.0)))
    far = find_grid(SmallRoom(grid_origin_m=(1.5, 1.0)))
    assert len(near.cells) == 9
    np.testing.assert_array_equal(near.locations_m, far.locations_m)
    assert near.locations_m[0].tolist() == [0.5, 0.5]


def test_a_box_blocks_one_cell():
    grid = find_grid(SmallRoom().add_box((0.7, 0.8), (0.7, 0.8)))
    assert len(grid.cells) == 15
    assert len(grid.edges) == 20
    assert [1, 1] not in grid.cells.tolist()


def test_a_thin_partition_blocks_the_moves_between_free_cells():
    grid = find_grid(SmallRoom().add_box((0.99, 1.01), (0.0, 0.95)))
    assert len(grid.cells) == 16
    missing = {((1, 0), (2, 0)), ((1, 1), (2, 1))}
    assert edge_set(grid) == edge_set(find_grid(SmallRoom())) - missing


def test_the_larger_of_two_compartments_is_kept():
    grid = find_grid(SmallRoom(width_m=3.0).add_box((0.98, 1.02), (0.0, 2.0)))
    assert grid.component_sizes == (16, 8)
    assert grid.cells[:, 0].min() == 2
    assert len(grid.graph) == 64
    assert len(grid.edges) == 24


@pytest.mark.parametrize(
    ("height_m", "cells"),
    [((0.6, 0.65), 15), ((1.45, 1.6), 15), ((1.6, 1.7), 16), ((0.0, 0.019), 16), ((0.0, 0.021), 15), ((0.0, 0.3), 15)],
    ids=["table top", "low shelf", "high shelf", "rug below 2 cm", "rug above 2 cm", "stool"],
)
def test_the_agent_passes_over_rugs_and_under_high_shelves_only(height_m, cells):
    grid = find_grid(SmallRoom().add_box((0.7, 0.8), (0.7, 0.8), height_m))
    assert len(grid.cells) == cells


def test_pictures_of_furniture_block_nothing():
    room = SmallRoom().add_box((0.0, 2.0), (0.0, 2.0), group=2)
    assert len(find_grid(room).cells) == 16


def test_a_turned_box_blocks_what_it_covers():
    room = SmallRoom()
    eighth_turn = [np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)]
    room.spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=[1, 1, 0.5], size=[1.2, 0.01, 0.5], quat=eighth_turn, group=3
    )
    grid = find_grid(room)
    assert grid.component_sizes == (6, 6)  # the diagonal takes 4 of 16 cells
    side = grid.cells[:, 0] - grid.cells[:, 1]
    assert (side > 0).all() or (side < 0).all()


@pytest.mark.parametrize(("radius_m", "cells"), [(0.289, 15), (0.291, 11)])
def test_a_cylinder_blocks_what_comes_within_the_clearance(radius_m, cells):
    room = SmallRoom()
    room.spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0.75, 0.75, 0.5], size=[radius_m, 0.5, 0], group=3
    )
    # the next cells' centres are 0.5 m away: 0.2 radius + 0.01 clearance + 0.29
    assert sum(find_grid(room).component_sizes) == cells


def test_obstacles_placed_in_other_ways_are_refused():
    room = SmallRoom()
    room.spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1, 1, 1], euler=[0, 0, 45], group=3)
    with pytest.raises(AssertionError, match="by pos and quat"):
        find_grid(room)


def test_gaps_agree_with_plain_geometry_on_random_boxes():
    rng = np.random.default_rng(0)
    agent = AgentShape()
    for _ in range(10):
        room = SmallRoom(width_m=4.0, depth_m=3.0)
        low = rng.uniform(0, 3, (5, 2))
        boxes = np.stack([low, low + rng.uniform(0.05, 0.6, (5, 2))], axis=1)  # (5, low and high, x and z)
        for (x0, z0), (x1, z1) in boxes:
            room.add_box((x0, x1), (z0, z1))
        grid = find_grid(room)
        points = np.stack(np.meshgrid(np.arange(8), np.arange(6), indexing="ij"), -1).reshape(-1, 2)
        centres_m = 0.25 + 0.5 * points
        outside_m = np.maximum(boxes[:, 0] - centres_m[:, None], centres_m[:, None] - boxes[:, 1]).clip(0)
        free = np.linalg.norm(outside_m, axis=-1).min(axis=1) > agent.radius_m + agent.clearance_m
        assert sum(grid.component_sizes) == free.sum()
        for first, second in grid.edges:
            middle_m = grid.locations_m[[first, second]].mean(axis=0)
            half_m = np.where(grid.cells[first] != grid.cells[second], 0.25, 0.2)
            gap_m = np.maximum(boxes[:, 0] - middle_m, middle_m - boxes[:, 1]) - half_m  # (5, 2)
            assert gap_m.max(axis=1).min() > 0


def test_the_smallest_margin_is_the_nearest_decision():
    room = SmallRoom(grid_origin_m=(0.4, 0.4), width_m=3, depth_m=3).add_box((1.133, 1.35), (0.38, 0.42))
    # cell (0.9, 0.4) ends at 1.1: 0.033 to the box, less the clearance of 0.01
    assert find_grid(room).smallest_margin_m == pytest.approx(0.023, abs=1e-9)


def test_four_right_turns_and_back_and_forth_return():
    graph = find_grid(SmallRoom().add_box((0.7, 0.8), (0.7, 0.8))).graph
    states = np.arange(len(graph))
    turned = states
    for _ in range(4):
        turned = graph[turned, Action.TURN_RIGHT]
    np.testing.assert_array_equal(turned, states)
    np.testing.assert_array_equal(graph[graph[:, Action.TURN_RIGHT], Action.TURN_LEFT], states)
    moved = graph[:, Action.MOVE_FORWARD]
    went = moved >= 0
    np.testing.assert_array_equal(graph[moved[went], Action.MOVE_BACKWARD], states[went])
    np.testing.assert_array_equal(states[went] % 4, moved[went] % 4)


def test_headings_turn_clockwise_seen_from_above():
    grid = find_grid(SmallRoom())
    locations, headings = grid.state_locations_m, grid.state_headings_deg
    steps = {0: (0, 0.5), 90: (0.5, 0), 180: (0, -0.5), 270: (-0.5, 0)}
    for state, following in enumerate(grid.graph[:, Action.MOVE_FORWARD]):
        if following >= 0:
            np.testing.assert_allclose(locations[following] - locations[state], steps[headings[state]])
    right = grid.graph[:, Action.TURN_RIGHT]
    np.testing.assert_array_equal(headings[right], (headings + 90) % 360)


def test_a_room_without_room_is_one_clear_error():
    with pytest.raises(SceneError, match=r"^small: the agent fits nowhere .*seed"):
        find_grid(SmallRoom().add_box((0.0, 2.0), (0.0, 2.0)))


def test_a_single_cell_is_a_grid():
    grid = find_grid(SmallRoom(width_m=0.5, depth_m=0.5))
    assert grid.graph.tolist() == [[-1, 1, 3, -1], [-1, 2, 0, -1], [-1, 3, 1, -1], [-1, 0, 2, -1]]
    assert grid.edges.shape == (0, 2)
