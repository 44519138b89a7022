from __future__ import annotations

import numpy as np
import pytest

from clearway.mapping.beliefs import NO_ROOM, LatticePose
from clearway.mapping.following import SURE
from clearway.mapping.routes import FAR
from clearway.mapping.search import prices, probabilities, search_steps
from clearway.mapping.settings import MappingSettings
from clearway.scenes.actions import Action

SIDE = 9
START, END = LatticePose(0, 3, 4), LatticePose(0, 5, 4)


def steps(
    room: np.ndarray, *, shut: tuple[int, int, int] | None = None, cost: float = 4.0, toured: bool = False
) -> Action:
    """The first action to the end, which was seen, in a room of log-odds (SIDE, SIDE)."""
    evidence = np.zeros((1, 4, SIDE, SIDE), np.float32)
    evidence[0][END.index] = 30.0
    closed = np.zeros(evidence.shape, bool)
    if shut is not None:
        closed[0][shut] = True
    done = np.zeros(evidence.shape, bool)
    done[0][START.index] = True
    settings = MappingSettings(collision_cost=cost)
    action, _ = search_steps([START], evidence, done, room[None], closed, settings, toured=toured)
    return Action(int(action[0]))


def doubtful_ahead(held: float = -1.0) -> np.ndarray:
    """Free, but for the cell ahead, of which log-odds are held."""
    room = np.full((SIDE, SIDE), SURE, np.float32)
    room[4, 4] = held
    return room


def test_it_goes_round_what_may_block_where_collisions_cost_much():
    assert steps(doubtful_ahead(), cost=1.0) == Action.MOVE_FORWARD
    assert steps(doubtful_ahead(), cost=20.0) in (Action.TURN_LEFT, Action.TURN_RIGHT)


def test_without_a_tour_cells_that_were_only_seen_cost_what_they_turn_out_to_be():
    turned = (Action.TURN_LEFT, Action.TURN_RIGHT)
    even, likely, tried = doubtful_ahead(0.0), doubtful_ahead(4.0), doubtful_ahead(SURE)
    assert steps(even, cost=20.0) == Action.MOVE_FORWARD and steps(even, cost=20.0, toured=True) in turned
    assert steps(likely, cost=200.0) in turned and steps(likely, cost=200.0, toured=True) == Action.MOVE_FORWARD
    assert steps(tried, cost=200.0) == Action.MOVE_FORWARD


def test_backwards_is_dearer_where_a_cell_was_only_seen():
    room = np.full((SIDE, SIDE), SURE, np.float32)
    room[4, 4] = 4.0
    evidence, done = np.zeros((1, 4, SIDE, SIDE), np.float32), np.zeros((1, 4, SIDE, SIDE), bool)
    evidence[0][END.turned(2).index] = 30.0
    settings = MappingSettings(collision_cost=100.0)
    asked = [START.turned(2)], evidence, done, room[None], done, settings
    assert search_steps(*asked)[0].tolist()[0] in (Action.TURN_LEFT, Action.TURN_RIGHT)
    assert search_steps(*asked, toured=True)[0].tolist() == [Action.MOVE_BACKWARD]
    room[4, 4] = SURE
    assert search_steps(*asked)[0].tolist() == [Action.MOVE_BACKWARD]


def test_moves_cost_what_a_collision_is_likely_to():
    room = np.array([[[4.0, 0.0], [SURE, -SURE]]])
    shut = np.zeros((1, 4, 2, 2), bool)
    found = prices(room, shut, 16.0)[0]
    ahead, behind = found[:, 2]  # into the first row; from outside the lattice no move leads
    assert (ahead[0, 0], behind[0, 0]) == pytest.approx((1.8, 3.0))  # 0.05 of 16, 0.1 of 20
    assert (ahead[0, 1], behind[0, 1]) == pytest.approx((3.848, 4.56), abs=1e-3)  # 0.178 of 16 and of 20
    ahead, behind = found[:, 0]  # into the second
    assert (ahead[1, 0], behind[1, 0]) == pytest.approx((1, 1), abs=2e-4)
    assert ahead[1, 1] == behind[1, 1] == FAR
    bumped = prices(np.full((1, 2, 2), NO_ROOM), shut, 16.0)[0, 0, 0]
    assert bumped[1].tolist() == pytest.approx([34.9, 34.9], abs=0.1)  # dear, not impossible: eyes took it for free
    ahead, behind = prices(room, shut, 16.0, toured=True)[0, :, 2]
    np.testing.assert_array_equal(ahead, behind)
    assert ahead[0, 0] == pytest.approx(1 + 16 / (1 + np.exp(4)))


def test_no_way_leads_where_a_move_was_blocked_or_a_body_cannot_stand():
    free = np.full((SIDE, SIDE), SURE, np.float32)
    assert steps(free) == Action.MOVE_FORWARD
    assert steps(free, shut=(0, 3, 4)) in (Action.TURN_LEFT, Action.TURN_RIGHT)
    tried = free.copy()
    tried[4, 4] = -SURE
    assert steps(tried) in (Action.TURN_LEFT, Action.TURN_RIGHT)


def test_where_nothing_is_left_to_search_it_begins_anew():
    room = np.full((SIDE, SIDE), -SURE, np.float32)
    room[3:6, 4] = SURE
    evidence, shut = np.zeros((1, 4, SIDE, SIDE), np.float32), np.zeros((1, 4, SIDE, SIDE), bool)
    done = np.ones(evidence.shape, bool)
    evidence[0][END.index] = 5.0
    action, lost = search_steps([START], evidence, done, room[None], shut, MappingSettings(nearby=2.0))
    assert action.tolist() == [Action.MOVE_FORWARD] and lost.tolist() == [True]
    done[0, 1, 4, 4] = False
    _, lost = search_steps([START], evidence, done, room[None], shut, MappingSettings(nearby=2.0))
    assert lost.tolist() == [False]


def test_what_is_known_of_cells_counts_with_what_was_seen():
    room = np.full((1, 2, 2), -3.0)
    room[0, 1, 1] = 3.0
    evidence = np.zeros((1, 4, 2, 2))
    evidence[0, 2] = 1.0
    found = probabilities(evidence, room)
    assert np.isclose(found.sum(), 1) and np.unravel_index(found.argmax(), found.shape) == (0, 2, 1, 1)
    np.testing.assert_allclose(found[0, 2, 1, 1] / found[0, 2, 0, 0], np.exp(3.0), rtol=1e-6)


def first_of(evidence: np.ndarray, done: np.ndarray, start: LatticePose) -> Action:
    """The first action in a room that is free."""
    room, shut = np.full(evidence.shape[1:], SURE, np.float32), np.zeros((1, *evidence.shape), bool)
    found, _ = search_steps([start], evidence[None], done[None], room[None], shut, MappingSettings(nearby=2.0))
    return Action(int(found[0]))


def test_what_was_likely_and_is_not_there_makes_the_rest_of_it_unlikely():
    side = 41
    evidence, done = np.zeros((4, side, side), np.float32), np.zeros((4, side, side), bool)
    start = LatticePose(0, 12, 12)
    evidence[:, 12, :] = -30.0
    evidence[:, :12] = 0.0
    evidence[:, 13:] = -30.0  # nothing ahead but a place that looked much like the target, and what is beside it
    evidence[0, 34, 12], evidence[0, 35, 12] = 80.0, 50.0
    done[start.index] = True
    assert first_of(evidence, done, start) == Action.MOVE_FORWARD
    done[0, 34, 12] = True
    assert first_of(evidence, done, start) == Action.MOVE_BACKWARD


def test_it_goes_where_much_of_what_is_left_is_in_view():
    side = 25
    evidence, done = np.full((4, side, side), -30.0, np.float32), np.zeros((4, side, side), bool)
    start = LatticePose(0, 12, 12)
    done[start.index] = True
    evidence[0, 16, 12] = evidence[0, 8, 12] = 0.0
    evidence[0, 19, 11:14] = 0.0  # in view of the one ahead
    assert first_of(evidence, done, start) == Action.MOVE_FORWARD
    assert first_of(evidence[:, ::-1].copy(), done, start) == Action.MOVE_BACKWARD
