import numpy as np
import pytest

from clearway.generation.statistics import FIGURES, plan_statistics
from clearway.scenes.floor_plans import FloorPlan


def test_figures_of_a_hand_drawn_corridor() -> None:
    corridor = FloorPlan("corridor", np.array([[0, 0], [1, 0], [2, 0]]), cell_size_m=0.5)
    found = plan_statistics(corridor)
    assert (found.cells, found.blocked_share, found.dead_ends, found.parts) == (3, 0.0, 2, 1)
    assert found.blank_share == pytest.approx(8 / 12)  # 4 of 12 poses can move forward
    # to the far end: two moves; looking across at the start and back at the end: one turn more each
    assert found.longest_path_steps == 4
    assert set(FIGURES) <= set(found.to_json())


def test_figures_of_a_corner_and_of_two_parts() -> None:
    corner = FloorPlan("corner", np.array([[0, 0], [1, 0], [0, 1]]), cell_size_m=0.5)
    assert plan_statistics(corner).blocked_share == pytest.approx(0.25)
    apart = plan_statistics(FloorPlan("apart", np.array([[0, 0], [2, 0]]), cell_size_m=0.5))
    assert (apart.parts, apart.longest_path_steps, apart.blank_share, apart.dead_ends) == (2, 2, 1.0, 2)


def test_a_blocked_edge_is_no_way() -> None:
    cells = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    shut = FloorPlan("shut", cells, np.array([[[0, 0], [1, 0]]]), cell_size_m=0.5)
    assert plan_statistics(shut).dead_ends == 2
    assert plan_statistics(FloorPlan("open", cells, cell_size_m=0.5)).dead_ends == 0
