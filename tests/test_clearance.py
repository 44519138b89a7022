from dataclasses import replace

import numpy as np
import pytest

from clearway.clearance import scene_clearance_m
from helpers.made import corridor_scene, scene_of_cells


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
