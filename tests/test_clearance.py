from dataclasses import replace

import numpy as np
import pytest

from clearway.clearance import scene_clearance_m
from clearway.scenes.actions import Action
from helpers.made import CELL_SIZE_M, corridor_scene, grid_scene, scene_of_cells


def test_beside_a_wall_half_a_cell_is_free() -> None:
    assert scene_clearance_m(corridor_scene(5)).tolist() == [0.25] * 20


def test_in_the_middle_of_a_hall_the_walls_are_further_away() -> None:
    cells = np.argwhere(np.ones((5, 5), bool))
    clearance_m = scene_clearance_m(scene_of_cells(cells)).reshape(5, 5, 4)
    assert clearance_m[2, 2].tolist() == [1.25] * 4  # three cells of half a metre to the next blocked one
    assert clearance_m[1, 2].tolist() == [0.75] * 4
    assert clearance_m[0, 0].tolist() == [0.25] * 4


def test_a_pillar_counts_too() -> None:
    free = np.ones((7, 7), bool)
    free[3, 3] = False
    cells = np.argwhere(free)
    place = cells.tolist().index([2, 2])
    clearance_m = scene_clearance_m(scene_of_cells(cells))[4 * place]
    assert clearance_m == pytest.approx(np.hypot(0.5, 0.5) - 0.25)


def test_where_nothing_is_blocked_nothing_is_near() -> None:
    scene = corridor_scene(3)
    around = np.where(scene.graph < 0, np.arange(12)[:, None], scene.graph)
    assert np.isinf(scene_clearance_m(replace(scene, graph=around))).all()


@pytest.mark.parametrize("apart_m", [0.0, 0.05])
def test_the_distance_is_that_to_the_nearest_of_all_blocked_places(apart_m: float) -> None:
    scene = grid_scene(1)
    off_m = apart_m * np.random.default_rng(0).normal(size=scene.locations_m.shape)  # poses of a cell may lie apart
    moved = replace(scene, locations_m=scene.locations_m + off_m)
    turn = np.deg2rad(moved.headings_deg)
    ahead_m = CELL_SIZE_M * np.stack([np.sin(turn), np.cos(turn)], 1)
    blocked_m = np.concatenate(
        [
            (moved.locations_m + ahead_m)[moved.graph[:, Action.MOVE_FORWARD] < 0],
            (moved.locations_m - ahead_m)[moved.graph[:, Action.MOVE_BACKWARD] < 0],
        ]
    )
    far_m = np.linalg.norm(moved.locations_m[:, None] - blocked_m, axis=2).min(1)
    assert scene_clearance_m(moved) == pytest.approx(np.maximum(far_m - CELL_SIZE_M / 2, 0))
