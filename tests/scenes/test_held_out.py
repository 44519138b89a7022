from dataclasses import replace

import numpy as np
import pytest

from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.held_out import held_out_cells
from clearway.scenes.plan_scenes import floor_plan_scene
from helpers.made import scene_of_cells

CELLS = np.argwhere(np.ones((8, 5), bool))


@pytest.mark.parametrize(("count", "held"), [(40, 4), (25, 2), (12, 1), (2, 1), (1, 0)])
def test_a_tenth_of_the_cells_is_held_out(count: int, held: int) -> None:
    assert held_out_cells("room", CELLS[:count]).sum() == held


def test_name_and_cell_choose_and_order_does_not() -> None:
    chosen = held_out_cells("room-train-000001-living_room", CELLS)
    np.testing.assert_array_equal(held_out_cells("room-train-000001-living_room", CELLS[::-1]), chosen[::-1])
    assert np.flatnonzero(chosen).tolist() == [2, 5, 8, 20]
    assert (held_out_cells("room-train-000005-living_room", CELLS) != chosen).any()


def test_all_headings_of_a_cell_are_held_out_together() -> None:
    plan = FloorPlan("hall", CELLS + np.array([-3, 9]), cell_size_m=0.5)
    scene = floor_plan_scene(plan, 4)
    poses = scene.held_out
    assert poses.shape == (160,) and poses.dtype == np.bool_
    np.testing.assert_array_equal(poses.reshape(-1, 4), np.repeat(held_out_cells("hall", plan.cells)[:, None], 4, 1))
    shuffled = np.random.default_rng(0).permutation(160)
    places = np.argsort(shuffled)
    graph = np.where(scene.graph[shuffled] < 0, -1, places[scene.graph[shuffled]]).astype(np.int32)
    other = replace(
        scene,
        graph=graph,
        locations_m=scene.locations_m[shuffled],
        headings_deg=scene.headings_deg[shuffled],
        features=None,
    )
    np.testing.assert_array_equal(other.held_out, poses[shuffled])


def test_cells_halfway_between_whole_numbers_are_told_apart() -> None:
    names, chosen = [f"room {number}" for number in range(40)], []
    cells = np.stack([np.arange(10), np.zeros(10, np.int64)], axis=1)
    for name in names:
        scene = scene_of_cells(cells, name=name)
        halfway = replace(scene, locations_m=scene.locations_m + 0.25)
        np.testing.assert_array_equal(halfway.held_out, scene.held_out)
        chosen.append(int(np.flatnonzero(halfway.held_out)[0]))
    assert len(set(chosen)) > 7
