from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.rooms.camera import first_person_view
from clearway.rooms.detail import FULL, SMALL, Detail, detail_for, recorded_detail
from clearway.rooms.draw import draw_parts
from clearway.rooms.frame import Frame
from clearway.rooms.pieces import FIXED
from clearway.rooms.plans import plan_room
from clearway.rooms.plans.plan_room import build_plan_room
from clearway.rooms.render import render
from clearway.rooms.room import Room
from clearway.scenes.floor_plans import Area
from helpers.plan_maps import ISLAND, plan_of, walled


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


@pytest.mark.slow
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


def mean_colour(room: Room, material: str) -> np.ndarray:
    """Of its picture, 0 to 255; black where it has none."""
    texture = room.spec.texture(f"{material} texture")
    return np.zeros(3) if texture is None else np.frombuffer(texture.data, np.uint8).reshape(-1, 3).mean(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "seed"),
    [
        (plan_of("island", ISLAND), 1),
        (walled(areas=(Area("bathroom", (1, 1), (3, 3)), Area("kitchen", (5, 1), (7, 3)))), 0),
    ],
)
def test_a_room_in_small_detail_is_made_by_the_same_draws(monkeypatch, plan, seed):
    monkeypatch.setattr(plan_room, "bake", lambda room, **options: None)  # which draws for every texel
    full, small = (build_plan_room(plan, seed, detail=detail)[0] for detail in (FULL, SMALL))
    for stream in ("rng", "layout_rng"):
        assert getattr(full, stream).bit_generator.state == getattr(small, stream).bit_generator.state
    assert [part.material for part in full.parts] == [part.material for part in small.parts]
    assert np.allclose([part.position_m for part in full.parts], [part.position_m for part in small.parts])
    for name in {part.material for part in full.parts if part.material}:
        assert np.array_equal(full.tint_of(name), small.tint_of(name))
        assert np.allclose(mean_colour(full, name), mean_colour(small, name), atol=4), name
    for one, other in zip(full.surfaces, small.surfaces, strict=True):
        assert one.name == other.name
        assert [-(-side // 2) for side in one.albedo.shape[:2]] == list(other.albedo.shape[:2])
        assert np.abs(one.albedo.mean(axis=(0, 1)) - other.albedo.mean(axis=(0, 1))).max() < 0.01


def test_the_height_of_pictures_decides_the_detail_and_a_record_tells_it():
    sizes = ((96, 128), (160, 200), (160, 202), (95, 128), (96, 127), (300, 400))
    assert [detail_for(*size) for size in sizes] == ["small", "small", "full", "full", "full", "full"]
    assert recorded_detail("hall", {"detail": "small"}) == SMALL
    assert recorded_detail("hall", {}) == recorded_detail("hall", {"detail": "full"}) == FULL
    for odd in ("huge", 3, None, ["small"]):
        with pytest.raises(
            SceneError, match=r"hall: its room has the detail .*knows full, small\. Make the scene again"
        ):
            recorded_detail("hall", {"detail": odd})
