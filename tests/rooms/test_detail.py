from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.rooms.camera import first_person_view
from clearway.rooms.detail import FULL, SMALL, Detail
from clearway.rooms.draw import draw_parts
from clearway.rooms.frame import Frame
from clearway.rooms.pieces import FIXED
from clearway.rooms.plans.plan_room import build_plan_room
from clearway.rooms.render import render
from clearway.rooms.room import Room
from helpers.plan_maps import ISLAND, plan_of


def room_of(detail: Detail) -> Room:
    return Room("test room", 8.0, 3.0, 2.4, (0.25, 0.25), detail=detail)


def test_edges_too_fine_to_be_seen_are_sharp_and_others_have_one_strip():
    assert [FULL.segments(0.004, 1), FULL.segments(0.05, 3), FULL.segments(0.0, 0)] == [1, 3, 0]
    assert [SMALL.segments(0.004, 1), SMALL.segments(0.05, 3), SMALL.segments(0.05, 0)] == [0, 1, 0]


def faces_of(detail: Detail) -> list[int]:
    room = room_of(detail)
    room.box(Frame(1.0, 1.0), (0, 0, 0), (0.4, 0.4, 0.4), "white")
    room.box(Frame(1.0, 1.0), (0, 0, 0), (0.4, 0.4, 0.4), "white", bevel_m=0.05, segments=3)
    room.cylinder(Frame(1.0, 1.0), (0, 0, 0), 0.2, 0.4, "white")
    return [len(part.mesh.faces) for part in room.parts]


def test_a_room_in_small_detail_has_fewer_faces():
    assert faces_of(SMALL) == [12, 44, 4 * 16]
    full = faces_of(FULL)
    assert full[0] == 44 and full[1] > 100 and full[2] == 4 * 24


@pytest.mark.parametrize(("block_m", "geoms"), [(None, [2 * 44]), (2.0, [44, 44]), (20.0, [2 * 44])])
def test_furniture_that_is_alike_is_drawn_together_within_a_block(block_m, geoms):
    room = room_of(replace(FULL, block_m=block_m))
    for x_m in (1.0, 7.0):
        room.box(Frame(x_m, 1.0), (0, 0, 0), (0.4, 0.4, 0.4), "white")
    draw_parts(room, room.parts, np.array([[0.8] * 3, [0.81] * 3]), np.array([FIXED, FIXED]), 0)
    model = room.spec.compile()
    assert model.mesh_facenum.tolist() == geoms
    assert len(np.unique(model.geom_rgba, axis=0)) == 1


def test_small_pictures_of_a_plan_look_the_same_in_small_detail():
    plan = plan_of("island", ISLAND)
    pictures, faces = [], []
    for detail, fast in ((FULL, False), (SMALL, True)):
        room, layout = build_plan_room(plan, 1, detail=detail)
        places_m = np.repeat((plan.cells * plan.cell_size_m - np.array(layout.origin_m))[::4], 2, axis=0)
        headings_deg = np.arange(len(places_m)) * 50 % 360
        view = first_person_view(places_m, headings_deg, height_px=96, width_px=128, fast=fast)
        model = room.spec.compile()
        pictures.append(render(model, view, workers=1).astype(int))
        faces.append(model.mesh_facenum.sum())
    assert faces[1] < 0.6 * faces[0]
    assert np.abs(pictures[0] - pictures[1]).mean() < 7
    coarse = [some.reshape(len(some), 12, 8, 16, 8, 3).mean(axis=(2, 4)) for some in pictures]
    assert np.abs(coarse[0] - coarse[1]).mean() < 5
    assert np.abs(pictures[0].mean(axis=(1, 2, 3)) - pictures[1].mean(axis=(1, 2, 3))).max() < 5
