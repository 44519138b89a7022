"""The body among typed-in boxes: where moves end, what counts as a contact, how clearances are measured."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.live.around import RoomAround
from clearway.live.body import REACH_M, SAMPLES, Body
from clearway.rooms import ROOM_NAMES, build_room
from clearway.rooms.navigation import find_grid
from clearway.scenes.actions import BLOCKED, Action
from helpers.small_rooms import SmallRoom


def body_at(room: SmallRoom, x_m: float, z_m: float) -> Body:
    body = Body(RoomAround(room))
    body.stand_at(np.array([x_m, z_m]))
    return body


def large_room() -> SmallRoom:
    return SmallRoom(width_m=6.0, depth_m=6.0)


def test_a_wall_30_cm_ahead_ends_the_move_after_10_cm_with_one_contact():
    body = body_at(large_room().add_box((2.0, 4.0), (3.3, 3.4)), 3.0, 3.0)
    step = body.move(0.5, 0.0)
    assert step.contact
    assert step.travelled_m == pytest.approx(0.1, abs=0.002)  # 0.3 m less the radius of 0.2 m
    assert body.place_m == pytest.approx([3.0, 3.1], abs=0.002)
    assert not body.touches
    assert step.gaps_m.min() == 0
    assert step.gaps_m[0] == pytest.approx(0.1 - 0.5 / SAMPLES)
    assert (step.gaps_m[4:] == 0).all()  # 0.5 m in 20 samples: the fifth would lie 12.5 cm ahead


@pytest.mark.parametrize(("heading_deg", "arrived"), [(0, (3, 3.5)), (90, (3.5, 3)), (180, (3, 2.5)), (270, (2.5, 3))])
def test_a_free_move_goes_its_whole_length_along_the_heading(heading_deg, arrived):
    body = body_at(large_room(), 3.0, 3.0)
    step = body.move(0.5, heading_deg)
    assert not step.contact
    assert step.travelled_m == 0.5
    assert body.place_m == pytest.approx(arrived, abs=1e-12)


def test_backwards_is_away_from_the_heading():
    body = body_at(large_room(), 3.0, 3.0)
    body.move(-0.5, 90.0)
    assert body.place_m == pytest.approx([2.5, 3.0], abs=1e-12)


def test_the_edge_of_the_floor_is_a_wall():
    body = body_at(large_room(), 5.75, 3.0)
    step = body.move(0.5, 90.0)
    assert step.contact
    assert body.place_m[0] == pytest.approx(5.8, abs=0.002)
    assert body.wait().gaps_m == pytest.approx(np.full(SAMPLES, 0.001), abs=5e-4)  # it draws back a millimetre


def test_pushing_on_is_a_contact_each_time_and_goes_nowhere():
    body = body_at(large_room(), 5.75, 3.0)
    body.move(0.5, 90.0)
    before = body.place_m
    again = body.move(0.5, 90.0)
    assert again.contact and again.travelled_m == pytest.approx(0, abs=0.001)
    assert body.place_m == pytest.approx(before, abs=0.001)


def test_it_slides_along_a_wall_that_it_has_touched():
    body = body_at(large_room(), 5.75, 3.0)
    body.move(0.5, 90.0)
    along = body.move(0.5, 0.0)
    assert not along.contact
    assert along.gaps_m == pytest.approx(np.full(SAMPLES, 0.001), abs=5e-4)


def test_gaps_are_distances_between_surfaces_at_equal_moments():
    body = body_at(large_room().add_box((2.0, 4.0), (4.0, 4.1)), 3.0, 3.0)
    assert body.gap_m() == pytest.approx(0.8)  # 1 m less the radius
    gaps_m = body.move(0.5, 0.0).gaps_m
    assert gaps_m == pytest.approx(0.8 - 0.5 * np.arange(1, SAMPLES + 1) / SAMPLES)
    assert Body(RoomAround(large_room())).gap_m() < 0  # at the origin, in the corner of the floor


@pytest.mark.parametrize(("ahead_m", "steps"), [(0.4, 0), (0.69, 0), (0.71, 1), (1.19, 1), (1.21, 2)])
def test_free_steps_are_those_that_would_end_without_a_contact(ahead_m, steps):
    body = body_at(large_room().add_box((2.0, 4.0), (3.0 + ahead_m, 3.1 + ahead_m)), 3.0, 3.0)
    assert body.free_steps(0.5, 0.0, 2) == steps
    assert body.free_steps(-0.5, 180.0, 2) == steps
    assert body.free_steps(0.5, 180.0, 2) == 2
    assert body.place_m == pytest.approx([3.0, 3.0], abs=1e-12)  # it stays


def test_free_steps_find_what_moves_find_at_any_pose():
    room = large_room().add_box((2.0, 2.4), (3.3, 3.4)).add_box((4.0, 4.02), (1.0, 5.0)).add_box((1.0, 1.3), (1.0, 1.3))
    rng, body, found = np.random.default_rng(0), Body(RoomAround(room)), []
    for _ in range(400):
        place_m, heading_deg = rng.uniform(0.3, 5.7, 2), float(rng.uniform(0, 360))
        body.stand_at(place_m)
        if body.touches:
            continue
        free = body.free_steps(0.4, heading_deg, 1)
        assert free == (not body.move(0.4, heading_deg).contact), (place_m, heading_deg)
        found.append(free)
    assert 20 < len(found) - sum(found) < len(found) - 20


@pytest.mark.parametrize("ahead_m", np.linspace(0.2, 0.4, 9).tolist())
def test_free_steps_do_not_leap_over_a_post_that_is_grazed(ahead_m):
    post = (3.199, 3.209), (3.0 + ahead_m, 3.01 + ahead_m)
    body = body_at(large_room().add_box(*post), 3.0, 3.0)
    assert body.free_steps(0.5, 0.0, 1) == (not body.move(0.5, 0.0).contact)


def test_far_from_everything_the_gap_is_the_reach():
    assert body_at(large_room(), 3.0, 3.0).gap_m() == REACH_M


@pytest.mark.parametrize("height_m", [(0.0, 0.02), (1.6, 1.7)], ids=["rug", "high shelf"])
def test_what_lies_below_or_above_the_body_is_no_contact(height_m):
    body = body_at(large_room().add_box((2.0, 4.0), (3.3, 3.6), height_m), 3.0, 3.0)
    assert not body.move(0.5, 0.0).contact


@pytest.mark.parametrize("name", ["bathroom", pytest.param("kitchen", marks=pytest.mark.slow)])
def test_every_move_of_the_grid_has_the_same_outcome(name):
    assert name in ROOM_NAMES
    room = build_room(name, looks=False)
    grid = find_grid(room)
    body = Body(RoomAround(room))
    places_m, headings_deg = grid.state_locations_m, grid.state_headings_deg
    for state in range(len(grid.graph)):
        for action, sign in ((Action.MOVE_FORWARD, 1), (Action.MOVE_BACKWARD, -1)):
            body.stand_at(places_m[state])
            step = body.move(sign * 0.5, headings_deg[state])
            after = grid.graph[state, action]
            assert step.contact == (after == BLOCKED), (state, action)
            if after != BLOCKED:
                assert body.place_m == pytest.approx(places_m[after], abs=1e-9)
