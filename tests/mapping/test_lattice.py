from __future__ import annotations

import numpy as np
import pytest

from clearway.mapping.beliefs import NEXT, NEXT_AT_0, SEEN, LatticePose, add_sighting, add_standing, likeliest
from clearway.mapping.lattice import AHEAD, HEADINGS, RIGHT, lattice_of
from clearway.perception.around import PLACES_M
from clearway.perception.whereabouts import ELSEWHERE, WHEREABOUTS, bin_of

SIDE = 21
HALF = lattice_of(0.5)


def told(ahead_m: float, right_m: float, turn_deg: float) -> np.ndarray:
    """Evidence for one bin."""
    evidence = np.zeros(ELSEWHERE, np.float32)
    evidence[bin_of(np.array([ahead_m]), np.array([right_m]), np.array([turn_deg]))[0]] = 1
    return evidence


def test_every_bin_is_told_apart_and_what_is_far_is_elsewhere():
    steps = np.arange(-8, 9) * 0.5
    ahead, right, turn = np.meshgrid(steps, steps, np.arange(8) * 45.0, indexing="ij")
    found = bin_of(ahead, right, turn)
    assert sorted(found.ravel().tolist()) == list(range(ELSEWHERE)) and WHEREABOUTS == ELSEWHERE + 1
    assert bin_of(np.array([0.2, 4.4]), np.zeros(2), np.array([-10.0, 0.0])).tolist() == [
        bin_of(np.zeros(1), np.zeros(1), np.zeros(1))[0],
        ELSEWHERE,
    ]


def test_a_turn_to_the_right_makes_right_ahead():
    for heading in range(HEADINGS):
        assert RIGHT[heading].tolist() == AHEAD[(heading + 1) % HEADINGS].tolist()
        pose = LatticePose(heading, 5, 5)
        assert pose.moved(2).turned(2).moved(2).turned(2) == pose and pose.moved(-1) == pose.turned(2).moved(1).turned(
            2
        )


@pytest.mark.parametrize("heading", range(HEADINGS))
def test_what_is_seen_is_where_the_pose_and_the_bin_say(heading):
    pose = LatticePose(heading, 10, 9)
    belief = np.zeros((HEADINGS, SIDE, SIDE), np.float32)
    add_sighting(belief, pose, told(1.5, -1.0, 90.0), 2.0, HALF)
    place = np.array(pose.cell) + 3 * AHEAD[heading] - 2 * RIGHT[heading]
    assert likeliest(belief) == LatticePose((heading + 1) % HEADINGS, *place.tolist())
    assert belief.max() == belief.sum() == 2.0


def test_what_lies_beyond_the_edge_is_left_out():
    belief = np.zeros((HEADINGS, SIDE, SIDE), np.float32)
    add_sighting(belief, LatticePose(2, 0, 20), told(1.0, 0.0, 0.0), 1.0, HALF)
    assert not belief.any()
    add_sighting(belief, LatticePose(0, 0, 20), told(1.0, 0.0, 0.0), 1.0, HALF)
    assert likeliest(belief) == LatticePose(0, 2, 20) and belief.sum() == 1
    room = np.zeros((SIDE, SIDE), np.float32)
    add_standing(room, LatticePose(3, 3, 0), np.ones(len(PLACES_M), np.float32), 1.0, HALF)
    assert room.sum() == 8


def test_what_is_not_seen_counts_less_where_a_wall_may_be_between():
    pose, side = LatticePose(0, 10, 10), SIDE
    room = np.full((side, side), -1.0, np.float32)
    room[12, 10] = 4.0
    belief = np.zeros((HEADINGS, side, side), np.float32)
    add_sighting(belief, pose, np.full(ELSEWHERE, -4.0, np.float32), 1.0, HALF, room)
    assert -2.3 < belief[0, 12, 10] < -1.5 and -0.1 < belief[0, 13, 10] < 0
    belief[:] = 0
    add_sighting(belief, pose, np.full(ELSEWHERE, 4.0, np.float32), 1.0, HALF, room)
    assert belief[0, 12, 10] == belief[0, 13, 10] == 4.0


def test_many_weak_looks_are_not_a_strong_one():
    pose, belief = LatticePose(0, 10, 10), np.zeros((HEADINGS, SIDE, SIDE), np.float32)
    weak, strong = (told(1.0, 0.0, 0.0) * strength for strength in (2.0, 6.0))
    for _ in range(50):
        add_sighting(belief, pose, weak, 0.5, HALF, surest=1.5)
    assert belief[0, 12, 10] == belief.max() == 3.0
    for _ in range(50):
        add_sighting(belief, pose, strong, 0.5, HALF, surest=1.5)
    add_sighting(belief, pose, weak, 0.5, HALF, surest=1.5)
    assert belief[0, 12, 10] == 9.0
    add_sighting(belief, pose, -weak, 0.5, HALF, surest=1.5)
    assert belief[0, 12, 10] == 8.0


def test_eyes_are_never_as_sure_of_a_cell_as_who_tried_it():
    room = np.zeros((SIDE, SIDE), np.float32)
    room[11, 10] = -10.0
    evidence = np.zeros(len(PLACES_M), np.float32)
    for place in ((0.5, 0.0), (1.0, 0.5)):
        evidence[PLACES_M.index(place)] = 3.0
    for _ in range(5):
        add_standing(room, LatticePose(0, 10, 10), evidence, 1.0, HALF)
    assert room[11, 10] == -10.0 and room[12, 11] == SEEN and room.sum() == SEEN - 10


def test_of_the_cell_straight_ahead_the_last_look_tells_all():
    pose, side = LatticePose(1, 10, 10), LatticePose(0, 10, 9)
    look = np.full(len(PLACES_M), 2.0, np.float32)
    room = np.zeros((SIDE, SIDE), np.float32)
    for _ in range(3):
        add_standing(room, pose, look, 1.0, HALF, last_look=True)
    assert room[10, 11] == pytest.approx(NEXT_AT_0 + 2 * NEXT) and room[11, 11] == SEEN  # one beside it, by all looks
    add_standing(room, pose, -look, 1.0, HALF, last_look=True)
    assert room[10, 11] == pytest.approx(NEXT_AT_0 - 2 * NEXT) and room[11, 11] == 2
    add_standing(room, side, look, 1.0, HALF, last_look=True)  # seen from elsewhere it is as all others
    assert room[10, 11] == pytest.approx(NEXT_AT_0 - 2 * NEXT + 2)
    add_standing(room, pose, look, 0.0, HALF, last_look=True)  # from a pose that counts no more
    assert room[10, 11] == pytest.approx(NEXT_AT_0 + 2 * NEXT)


def test_by_shorter_steps_a_bin_is_of_more_poses_and_a_place_tells_of_the_cells_around_it():
    quarter = lattice_of(0.25)
    belief = np.zeros((HEADINGS, 2 * SIDE, 2 * SIDE), np.float32)
    add_sighting(belief, LatticePose(0, 10, 10), told(1.0, 0.0, 0.0), 1.0, quarter)
    halves = np.array([0.5, 1.0, 0.5])
    np.testing.assert_array_equal(belief[0, 13:16, 9:12], np.outer(halves, halves))
    assert belief.sum() == 4
    room = np.zeros((2 * SIDE, 2 * SIDE), np.float32)
    evidence = np.zeros(len(PLACES_M), np.float32)
    evidence[PLACES_M.index((1.0, 0.5))] = 2.0
    add_standing(room, LatticePose(0, 10, 10), evidence, 1.0, quarter)
    assert (room[14, 12], room[13, 12], room[14, 11], room[13, 11], room[12, 12]) == (2.0, 1.0, 1.0, 0.5, 0.0)
    before = room.copy()
    add_standing(room, LatticePose(0, 10, 10), evidence, 0.0, quarter, last_look=True)
    np.testing.assert_array_equal(room, before)  # tried with steps of half a metre alone
    assert len(quarter.around[0]) == 13 * 17 and np.array_equal(HALF.shares, np.eye(63))
