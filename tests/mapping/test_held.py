"""What an agent holds, laid over the scene: numbers typed in."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.mapping.beliefs import IMPOSSIBLE
from clearway.mapping.held import Laid, held_by

SIDE, MIDDLE, USUAL = 7, 3, -1.0


def state_of(*, row: int, column: int, heading: int) -> dict[str, np.ndarray]:
    """An agent that is sure to stand in the middle, looking ahead, and that the target is elsewhere."""
    here, goal = np.full((1, 4, SIDE, SIDE), IMPOSSIBLE), np.zeros((1, 4, SIDE, SIDE))
    here[0, 0, MIDDLE, MIDDLE] = 0
    goal[0, heading, MIDDLE + row, MIDDLE + column] = 30
    room = np.full((1, SIDE, SIDE), USUAL)
    room[0, MIDDLE + row, MIDDLE + column] = 2
    return {"here": here, "goal": goal, "room": room, "been": np.zeros(here.shape, bool)}


@pytest.mark.parametrize(
    ("heading_deg", "x_m", "z_m"),
    [(0, 1 + 0.5, 2 + 1.0), (90, 1 + 1.0, 2 - 0.5), (180, 1 - 0.5, 2 - 1.0), (270, 1 - 1.0, 2 + 0.5)],
)
def test_two_ahead_and_one_to_the_right_wherever_the_walk_began(heading_deg, x_m, z_m):
    held = held_by(state_of(row=2, column=1, heading=1), Laid(1.0, 2.0, heading_deg, 0.5), USUAL)
    assert held.cells[0] == pytest.approx([x_m, z_m, 1 / (1 + np.exp(-2))]) and len(held.cells) == 1
    assert held.target[0] == pytest.approx([x_m, z_m, (heading_deg + 90) % 360, 1])
    assert held.here.tolist() == [pytest.approx([1, 2, heading_deg, 1])]


def test_where_it_has_been_the_target_is_not_but_it_may_be_here():
    state = state_of(row=1, column=0, heading=0)
    state["been"][0, 0, MIDDLE + 1, MIDDLE] = True
    gone = held_by(state, Laid(0, 0, 0, 1.0), USUAL)
    assert not (gone.target[:, :3] == [0, 1, 0]).all(axis=1).any()
    state["goal"][0, 0, MIDDLE, MIDDLE] = 60
    state["been"][0, 0, MIDDLE, MIDDLE] = True
    here = held_by(state, Laid(0, 0, 0, 1.0), USUAL)
    assert here.target[0] == pytest.approx([0, 0, 0, 1])


def test_what_the_page_gets_is_plain_and_short():
    told = held_by(state_of(row=2, column=1, heading=1), Laid(1 / 3, 0, 0, 0.5), USUAL).to_json()
    assert told["cells"] == [[0.833, 1.0, 0.881]] and told["here"] == [[0.333, 0.0, 0.0, 1.0]]
