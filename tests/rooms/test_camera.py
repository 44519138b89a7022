from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from clearway.rooms.camera import View, eye_view, first_person_shot, first_person_view
from clearway.rooms.frustum import Frustum
from clearway.rooms.render import render
from clearway.rooms.taking import two_thirds
from clearway.rooms.topview import render_top_view
from clearway.scenes.sensors import SENSORS
from helpers.small_rooms import SmallRoom

WALLS = {  # a wall of each colour at the end of each heading's line of sight
    0: ((0.0, 4.0), (4.0, 4.1), (0.9, 0.1, 0.1)),
    90: ((4.0, 4.1), (0.0, 4.0), (0.1, 0.9, 0.1)),
    180: ((0.0, 4.0), (-0.1, 0.0), (0.1, 0.1, 0.9)),
    270: ((-0.1, 0.0), (0.0, 4.0), (0.9, 0.9, 0.1)),
}


def lit(room: SmallRoom) -> mujoco.MjModel:
    """The compiled room in even light."""
    headlight = room.spec.visual.headlight
    headlight.ambient[:] = [1, 1, 1]
    headlight.diffuse[:] = headlight.specular[:] = [0, 0, 0]
    return room.spec.compile()


def coloured_room() -> SmallRoom:
    room = SmallRoom(width_m=4, depth_m=4)
    for x_m, z_m, rgb in WALLS.values():
        room.add_box(x_m, z_m, group=2, rgb=rgb)
    return room


def assert_colour(pixel: np.ndarray, rgb: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(pixel, 255 * np.array(rgb), atol=12)


@pytest.mark.slow
def test_each_heading_looks_at_its_wall():
    headings_deg = np.array(list(WALLS))
    pictures = render(lit(coloured_room()), first_person_view(np.full((4, 2), 2.0), headings_deg), workers=1)
    assert pictures.shape == (4, 300, 400, 3)
    for picture, (_, _, rgb) in zip(pictures, WALLS.values(), strict=True):
        assert_colour(picture[150, 200], rgb)


def test_the_picture_is_level_at_one_metre_with_an_angle_of_view_of_60_degrees():
    room = coloured_room().add_box((2.4, 2.6), (3.0, 3.2), (0.0, 1.0), group=2, rgb=(0.9, 0.1, 0.9))
    view = first_person_view(np.full((1, 2), 2.0), np.array([0]))
    rows, columns = extent_of(render(lit(room), view, workers=1)[0], (0.9, 0.1, 0.9))
    focal_px = 150 / np.tan(np.radians(30))
    assert columns[0] == pytest.approx(200 + focal_px * 0.4 / 1.2, abs=2)  # far left edge; the near one: 0.4 / 1
    assert columns[1] == pytest.approx(200 + focal_px * 0.6 / 1.0, abs=2)
    assert rows[0] == pytest.approx(150, abs=2)  # its top is as high as the camera
    assert rows[1] == 299 or rows[1] == pytest.approx(150 + focal_px * 1.0 / 1.0, abs=2)


def test_ceilings_show_and_obstacles_do_not():
    view = first_person_view(np.full((1, 2), 2.0), np.array([0]))
    room = coloured_room().add_box((1.5, 2.5), (3.0, 3.2), group=3, rgb=(0.9, 0.1, 0.9))
    room.add_box((0.0, 4.0), (0.0, 4.0), (1.9, 2.0), group=1, rgb=(0.2, 0.9, 0.9))
    picture = render(lit(room), view, workers=1)[0]
    assert_colour(picture[150, 200], WALLS[0][2])
    assert_colour(picture[5, 200], (0.2, 0.9, 0.9))


def test_the_top_view_has_large_z_above_and_small_x_on_the_left_and_no_ceiling():
    room = SmallRoom(width_m=3.0, depth_m=4.0)
    room.add_box((-1.0, 4.0), (-1.0, 5.0), (-0.1, 0.0), group=2, rgb=(0.5, 0.6, 0.5))
    room.add_box((0.0, 0.5), (0.0, 0.3), (0.0, 1.0), group=2, rgb=(0.9, 0.1, 0.9))
    room.add_box((2.0, 3.0), (3.8, 4.0), (0.0, 2.0), group=2, rgb=(0.1, 0.9, 0.9))
    room.add_box((0.0, 3.0), (0.0, 4.0), (2.4, 2.5), group=1)
    top_view = render_top_view(lit(room), room.width_m, room.depth_m)
    assert top_view.image.shape == (400, 300, 3)
    assert (top_view.x_min_m, top_view.x_max_m, top_view.z_min_m, top_view.z_max_m) == (0.0, 3.0, 0.0, 4.0)
    assert_colour(top_view.image[200, 150], (0.5, 0.6, 0.5))
    assert extent_of(top_view.image, (0.9, 0.1, 0.9)) == ((370, 399), (0, 49))
    assert extent_of(top_view.image, (0.1, 0.9, 0.9)) == ((0, 19), (200, 299))


def extent_of(picture: np.ndarray, rgb: tuple[float, float, float]) -> tuple[tuple[int, int], tuple[int, int]]:
    """First and last row, first and last column with the colour."""
    there = np.abs(picture - 255 * np.array(rgb)).max(axis=2) < 12
    rows, columns = np.nonzero(there.any(axis=1))[0], np.nonzero(there.any(axis=0))[0]
    return (int(rows[0]), int(rows[-1])), (int(columns[0]), int(columns[-1]))


def depth_in_m(room: SmallRoom, view: View) -> np.ndarray:
    pictures = render(lit(room), replace(view, sensor="depth"), workers=1)
    assert pictures.dtype == np.uint16  # whole millimetres
    return SENSORS["depth"](view.height_px, view.width_px).values(pictures)


def test_depth_is_the_distance_to_the_walls_in_metres():
    view = first_person_view(np.array([[1.0, 0.5]] * 4), np.array(list(WALLS)))
    depths_m = depth_in_m(coloured_room(), view)
    assert depths_m.shape == (4, 300, 400) and depths_m.dtype == np.float32
    for depth_m, wall_m in zip(depths_m, (3.5, 3.0, 0.5, 1.0), strict=True):
        # along the middle of the view: the wall ahead is as deep at its sides as in its middle
        np.testing.assert_allclose(depth_m[145:155, 190:210], wall_m, atol=0.0011)
    assert depths_m[0, 145:155, 60:80].max() < 3.5 - 1  # the wall at x = 0 is nearer
    np.testing.assert_allclose(depths_m[2, 150, 60:340], 0.5, atol=0.0011)


def test_nothing_ahead_is_as_far_as_depth_reaches():
    view = first_person_view(np.array([[1.0, 0.5]]), np.array([0]))
    far = SmallRoom().add_box((-9, 9), (22.0, 22.1), group=2).add_box((0.9, 1.1), (19.5, 19.6), group=2)
    depth_m = depth_in_m(far, view)[0]
    assert depth_m.max() == np.float32(20) and depth_m[:20].min() == np.float32(20)
    np.testing.assert_allclose(depth_m[150, 200], 19.0, atol=0.01)


def test_an_edge_has_no_depth_between_that_of_its_two_sides():
    room = coloured_room().add_box((0.7, 1.3), (1.5, 1.6), (0.8, 1.17), group=2)
    room.spec.visual.quality.offsamples = 8
    depth_m = depth_in_m(room, first_person_view(np.array([[1.0, 0.5]]), np.array([7])))[0]
    box = depth_m < 1.3
    assert box.sum() > 1000
    near_box = depth_m[100:160, 100:300]
    assert np.all((near_box < 1.3) | (near_box > 1.6))


@pytest.mark.slow
def test_depth_leaves_colour_as_it_is():
    view = first_person_view(np.full((4, 2), 2.0), np.array(list(WALLS)))
    model = lit(coloured_room())
    alone = render(model, view, workers=1)
    render(model, replace(view, sensor="depth"), workers=1)
    np.testing.assert_array_equal(render(model, view, workers=1), alone)


def frustum_of(model: mujoco.MjModel, view: View) -> Frustum:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Frustum(model, data, view)


def test_what_is_behind_or_beside_the_camera_is_hidden_while_the_picture_is_taken():
    model, view = lit(coloured_room()), eye_view(height_px=96, width_px=128, fast=True)
    frustum = frustum_of(model, view)
    for heading_deg, seen in ((0, [0]), (90, [1]), (20, [0, 1]), (315, [0, 3])):  # walls in the order of WALLS
        with frustum.of(first_person_shot(2.0, 2.0, heading_deg)):
            assert np.flatnonzero(model.geom_group == 2).tolist() == seen
        assert np.all(model.geom_group == 2)
    with frustum.of(first_person_shot(2.0, 2.0, 0, pitch_deg=85)):
        assert not np.any(model.geom_group == 2)


def test_a_mirror_in_sight_may_show_everything():
    room = coloured_room()
    room.spec.add_material(name="glass", reflectance=0.5)
    room.spec.geoms[0].material = "glass"
    model = lit(room)
    frustum = frustum_of(model, eye_view(fast=True))
    with frustum.of(first_person_shot(2.0, 2.0, 0)):
        assert np.all(model.geom_group == 2)
    with frustum.of(first_person_shot(2.0, 2.0, 180)):  # it is behind the camera
        assert np.flatnonzero(model.geom_group == 2).tolist() == [2]


def fast_and_not(model: mujoco.MjModel, view: View) -> tuple[np.ndarray, np.ndarray]:
    return render(model, replace(view, fast=True), workers=1), render(model, view, workers=1)


@pytest.mark.slow
def test_fast_pictures_look_the_same():
    rng, room = np.random.default_rng(3), coloured_room()
    for x_m, z_m in rng.uniform(0, 4, (30, 2)):
        room.add_box((x_m, x_m + 0.1), (z_m, z_m + 0.1), (0.2, 1.5), group=2, rgb=tuple(rng.random(3)))
    shots = [
        first_person_shot(x_m, z_m, heading_deg, pitch_deg=pitch_deg)
        for x_m, z_m, heading_deg, pitch_deg in rng.uniform((0.5, 0.5, 0, -30), (3.5, 3.5, 360, 30), (20, 4))
    ]
    view, model = eye_view(shots, height_px=96, width_px=128), lit(room)
    fast, plain = fast_and_not(model, view)
    assert fast.shape == plain.shape == (20, 96, 128, 3)
    off = np.abs(fast.astype(int) - plain).max(axis=3)
    assert np.mean(off) < 2 and np.mean(off > 60) < 0.006  # edges are smooth in both
    np.testing.assert_array_equal(*fast_and_not(model, replace(view, sensor="depth")))  # nothing in sight is left out


def test_a_piece_that_is_moved_into_sight_is_seen():
    room = coloured_room()
    body = room.spec.worldbody.add_body(name="piece", mocap=True)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[2, 0.5, 1], size=[0.3] * 3, rgba=[0.9, 0.1, 0.9, 1], group=2)
    shots = [first_person_shot(2.0, 2.0, 0, moved_m=(moved_m,)) for moved_m in ((0.0, 0.0, 0.0), (0.0, 2.7, 0.0))]
    behind, ahead = render(lit(room), eye_view(shots, height_px=96, width_px=128, fast=True), workers=1)
    assert_colour(behind[48, 64], WALLS[0][2])
    assert_colour(ahead[48, 64], (0.9, 0.1, 0.9))


def test_two_thirds_of_a_picture_are_means_of_its_areas():
    row = np.array([[0, 90, 30, 9, 9, 9]], np.uint8)  # (2 x 0 + 90) / 3, (90 + 2 x 30) / 3, 9, 9
    picture = np.repeat(np.repeat(row, 3, axis=0)[..., None], 3, axis=2)
    assert two_thirds(picture)[..., 0].tolist() == [[30, 50, 9, 9]] * 2
    assert two_thirds(picture.swapaxes(0, 1))[..., 2].tolist() == [[30] * 2, [50] * 2, [9] * 2, [9] * 2]
    assert two_thirds(np.full((3, 6, 3), 255, np.uint8)).min() == 255


@pytest.mark.parametrize("change", [{"height_px": 95}, {"width_px": 127}, {"orthographic": True}])
def test_fast_pictures_have_even_sides_and_perspective(change):
    with pytest.raises(ValueError, match="even number of rows and columns"):
        replace(eye_view(height_px=96, width_px=128, fast=True), **change)
