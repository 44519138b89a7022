from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from clearway.rooms.frame import Frame, along, compose, rotation, turn
from clearway.rooms.light import bake
from clearway.rooms.occupancy import VOXEL_M, chessboard_distance, occupancy_of
from clearway.rooms.parts import Lamp
from clearway.rooms.room import Room
from clearway.rooms.shell import SIDES, Finish, add_surfaces, wall_size_m
from clearway.rooms.surfaces import pixels

GREY = np.full(3, 0.5)


def empty_room(mirrored: bool = False) -> Room:
    return Room("test room", 4.0, 3.0, 2.4, (0.25, 0.25), mirrored=mirrored)


def grey(width_m: float, height_m: float) -> np.ndarray:
    return np.broadcast_to(GREY, (pixels(height_m), pixels(width_m), 3))


def with_shell(room: Room) -> Room:
    walls = {side: grey(*wall_size_m(room, side)) for side in SIDES}
    floor = grey(room.width_m, room.depth_m)
    add_surfaces(room, Finish(floor, floor, walls, skirting=None, cornice=None))
    return room


def floor_picture(room: Room) -> np.ndarray:
    """The lit floor, (height, width) in [0, 1]; row 0 at y = 0."""
    texture = room.spec.texture("floor texture")
    data = np.frombuffer(texture.data, np.uint8).reshape(texture.height, texture.width, 3)
    return data.mean(axis=2) / 255


def test_rays_stop_at_walls_and_boxes():
    room = empty_room()
    room.box(Frame(3.0, 1.5), (0, 0, 0), (0.4, 0.4, 1.0), "white")
    solid = occupancy_of((4.0, 3.0, 2.4), room.parts)
    start = np.array([[1.0, 1.5, 0.5], [1.0, 1.5, 0.5], [1.0, 1.5, 1.5], [1.0, 1.5, 0.5]])
    rays = np.array([[1.0, 0, 0], [-1.0, 0, 0], [1.0, 0, 0], [0, 0, 1.0]])
    assert solid.distance_m(start, rays) == pytest.approx([1.8, 1.0, 3.0, 1.9], abs=1.5 * VOXEL_M)
    assert solid.is_solid(np.array([[3.0, 1.5, 0.5], [1.0, 1.5, 0.5], [-0.1, 1.0, 1.0]])).tolist() == [
        True,
        False,
        True,
    ]


def test_rays_stop_where_they_have_come_far_enough():
    solid = occupancy_of((4.0, 3.0, 2.4), [])
    start, ray = np.array([[1.0, 1.5, 0.5]] * 3), np.array([[1.0, 0, 0]] * 3)
    to_wall, short, shorter = solid.distance_m(start, ray, np.array([9.0, 1.0, 0.2]))
    assert to_wall == solid.distance_m(start, ray)[0] == pytest.approx(3.0, abs=1.5 * VOXEL_M)
    assert 1.0 <= short < to_wall
    assert 0.2 <= shorter <= short


def test_distances_are_those_of_a_chess_king():
    rng = np.random.default_rng(0)
    for shape, share in (((12, 9, 7), 0.05), ((5, 30, 4), 0.01), ((1, 3, 8), 0.3)):
        solid = rng.random(shape) < share
        solid[0, 0, 0] = True
        assert np.array_equal(chessboard_distance(solid), ndimage.distance_transform_cdt(~solid, "chessboard"))


def test_turned_and_tilted_parts_fill_the_voxels_within_them():
    for tilt, yaw_deg in (((1.0, 0.0, 0.0, 0.0), 30.0), (turn("x", 25), 70.0)):
        room = empty_room()
        room.box(Frame(2.0, 1.5, yaw_deg), (0, 0, 0.5), (1.2, 0.4, 0.6), "white", tilt=tilt)
        room.cylinder(Frame(1.0, 0.8, yaw_deg), (0, 0, 0.4), 0.3, 0.9, "white", tilt=tilt)
        solid = occupancy_of((4.0, 3.0, 2.4), room.parts)
        places = (np.indices((100, 75, 60)).reshape(3, -1).T + 0.5) * VOXEL_M
        inside = np.zeros(len(places), bool)
        for part in room.parts:
            local = (places - part.centre_m) @ part.rotation / part.half_extents_m
            filled = np.abs(local).max(axis=1) <= 1
            inside |= filled & ((local[:, :2] ** 2).sum(axis=1) <= 1) if part.round else filled
        assert np.array_equal(solid.is_solid(places), inside) and inside.sum() > 4000


def test_light_passes_glass_and_fills_a_thin_board():
    room = empty_room()
    room.box(Frame(2.0, 1.5), (0, 0, 0.5), (0.01, 1.0, 1.0), "glass", segments=0)
    start, ray = np.array([[1.0, 1.5, 1.0]]), np.array([[1.0, 0, 0]])
    assert occupancy_of((4.0, 3.0, 2.4), room.parts).distance_m(start, ray)[0] > 2.9
    room.box(Frame(2.5, 1.5), (0, 0, 0.5), (0.01, 1.0, 1.0), "white", segments=0)
    blocked = occupancy_of((4.0, 3.0, 2.4), room.parts).distance_m(start, ray)[0]
    assert blocked == pytest.approx(1.5, abs=1.5 * VOXEL_M)


def test_a_table_darkens_the_floor_below_it():
    room = with_shell(empty_room())
    room.lamps.append(Lamp(np.array([2.0, 1.5, 2.0]), 0.2, np.ones(3), 1.5))
    room.box(Frame(1.0, 1.5), (0, 0, 0.4), (0.8, 0.8, 0.04), "white")
    bake(room)
    floor = floor_picture(room)
    under, open_floor = floor[pixels(1.5), pixels(1.0)], floor[pixels(1.5), pixels(3.0)]
    assert under < 0.75 * open_floor
    assert 0.2 < open_floor < 0.95
    room.spec.compile()


def test_a_mirrored_room_puts_parts_and_light_on_the_other_side():
    pictures, places = [], []
    for mirrored in (False, True):
        room = with_shell(empty_room(mirrored))
        room.lamps.append(Lamp(room.place(Frame(0.8, 1.5), (0, 0, 2.0)), 0.2, np.ones(3), 1.5))
        room.box(Frame(1.0, 2.0, 30.0), (0.2, 0, 0), (0.6, 0.3, 0.5), "white", tilt=turn("x", 10))
        places.append(room.parts[0].centre_m)
        bake(room)
        pictures.append(floor_picture(room))
    assert places[1] == pytest.approx(places[0] * [-1, 1, 1] + [4.0, 0, 0])
    assert np.abs(pictures[1][:, ::-1] - pictures[0]).mean() < 0.02
    assert np.abs(pictures[1] - pictures[0]).mean() > 0.03


def test_frames_and_quaternions_turn_counter_clockwise():
    frame = Frame(1.0, 2.0, 90.0)
    assert frame.point(1.0, 0.0, 0.5) == pytest.approx([1.0, 3.0, 0.5])
    assert frame.moved(0.0, 1.0).point(0, 0, 0) == pytest.approx([0.0, 2.0, 0.0])
    assert rotation(np.array(turn("z", 90))) @ [1, 0, 0] == pytest.approx([0, 1, 0])
    both = compose(np.array(turn("z", 90)), np.array(turn("x", 90)))
    assert rotation(both) == pytest.approx(rotation(np.array(turn("z", 90))) @ rotation(np.array(turn("x", 90))))
    for direction in ([0, 0, 1], [0, 0, -1], [1, 2, -0.5]):
        unit = np.array(direction) / np.linalg.norm(direction)
        assert rotation(np.array(along(np.array(direction)))) @ [0, 0, 1] == pytest.approx(unit)
