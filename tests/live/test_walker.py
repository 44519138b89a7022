"""The walker: errors of moves and turns, arcs, zones as on the grid."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.live.around import RoomAround
from clearway.live.body import Body
from clearway.live.conditions import Perturbations
from clearway.live.draws import Draws
from clearway.live.walker import Walker, near
from clearway.rooms import build_room
from clearway.rooms.navigation import find_grid
from clearway.scenes.actions import Action
from clearway.zones import Zone, pose_zones
from helpers.small_live import walkable_room
from helpers.small_rooms import SmallRoom

WIDE = SmallRoom(width_m=6.0, depth_m=6.0)


def walker_at(x_m: float, z_m: float, heading_deg: float, room: SmallRoom = WIDE, **strengths: float) -> Walker:
    draws = Draws(0, Perturbations(**strengths))
    return Walker(Body(RoomAround(room)), (x_m, z_m, heading_deg), draws, step_m=0.5, turn_deg=90.0)


@pytest.mark.parametrize("room", ["walkable", "bathroom"])
def test_zones_in_the_poses_of_a_grid_are_the_grids(room):
    built = walkable_room() if room == "walkable" else build_room(room, looks=False)
    grid = find_grid(built)
    found = []
    for (x_m, z_m), heading_deg in zip(grid.state_locations_m, grid.state_headings_deg.tolist(), strict=True):
        found.append(walker_at(x_m, z_m, float(heading_deg), built).zone())
    expected = pose_zones(grid.graph)
    assert set(expected.tolist()) == set(Zone)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(("ahead_m", "zone"), [(0.6, Zone.COLLISION), (0.8, Zone.PRECOLLISION), (1.3, Zone.FREE)])
def test_zones_between_the_cells_go_by_the_distance_along_the_heading(ahead_m, zone):
    room = SmallRoom(width_m=6.0, depth_m=6.0).add_box((2.0, 4.0), (3.0 + ahead_m, 3.1 + ahead_m))
    assert walker_at(3.0, 3.0, 0.0, room).zone() is zone
    assert walker_at(3.0, 3.0, 180.0, room).zone() is zone  # behind it
    assert walker_at(3.0, 3.0, 90.0, room).zone() is Zone.FREE


def test_moves_and_turns_are_exact_without_errors():
    walker = walker_at(3.0, 3.0, 0.0)
    for action in (Action.TURN_RIGHT, Action.MOVE_FORWARD, Action.TURN_LEFT, Action.MOVE_BACKWARD):
        walker.act(action)
    assert walker.pose == pytest.approx((3.5, 2.5, 0.0))


def test_errors_have_the_deviation_asked_for():
    turned, moved = [], []
    walker = walker_at(3.0, 3.0, 0.0, distance_noise=0.1, angle_noise=8.0)
    for _ in range(400):
        walker.heading_deg = 0.0
        walker.body.stand_at(np.array([3.0, 3.0]))
        moved.append(walker.act(Action.MOVE_FORWARD).travelled_m)
        walker.act(Action.TURN_RIGHT)
        turned.append(walker.heading_deg)
    assert np.mean(moved) == pytest.approx(0.5, abs=0.02) and np.std(moved) == pytest.approx(0.1, rel=0.15)
    assert np.mean(turned) == pytest.approx(90, abs=1.5) and np.std(turned) == pytest.approx(8, rel=0.15)


def test_driving_straight_or_turning_alone_is_a_share_of_the_action():
    walker = walker_at(3.0, 3.0, 90.0)
    walker.drive(0.5, 0.0)
    assert walker.pose == pytest.approx((3.25, 3.0, 90.0))
    walker.drive(-1.0, 0.0)
    assert walker.pose == pytest.approx((2.75, 3.0, 90.0))
    walker.drive(0.0, -0.5)
    assert walker.pose == pytest.approx((2.75, 3.0, 45.0))


def test_driving_and_turning_is_an_arc():
    walker = walker_at(3.0, 3.0, 0.0)
    walker.drive(1.0, 1.0)  # a quarter of a circle, 0.5 m long, to the right
    radius_m = 0.5 / (np.pi / 2)
    assert walker.pose == pytest.approx((3.0 + radius_m, 3.0 + radius_m, 90.0))
    walker = walker_at(3.0, 3.0, 0.0)
    assert walker.drive(1.0, 1.0).travelled_m == pytest.approx(0.5, abs=0.002)  # of chords, somewhat less than the arc


def test_a_contact_ends_an_arc_and_not_its_turn():
    room = SmallRoom(width_m=6.0, depth_m=6.0).add_box((2.0, 4.0), (3.3, 3.4))
    walker = walker_at(3.0, 3.0, 0.0, room)
    assert walker.drive(1.0, 1.0).contact
    x_m, z_m, heading_deg = walker.pose
    assert heading_deg == 90.0 and z_m == pytest.approx(3.1, abs=0.01) and 3.0 < x_m < 3.1
    assert not walker.body.touches


def test_near_is_near_in_place_and_heading():
    assert near((1.0, 1.0, 350.0), (1.0, 1.25, 20.0), 0.25, 30.0)
    assert not near((1.0, 1.0, 350.0), (1.0, 1.26, 20.0), 0.25, 30.0)
    assert not near((1.0, 1.0, 349.0), (1.0, 1.25, 20.0), 0.25, 30.0)
    poses = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 90.0]])
    assert near(poses, (1.0, 1.0, 80.0), 0.1, 15.0).tolist() == [False, True]
