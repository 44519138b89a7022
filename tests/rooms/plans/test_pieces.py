from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from clearway.rooms.frame import Frame, rotation
from clearway.rooms.groups import OBSTACLE_GROUP
from clearway.rooms.plans.layout import Piece
from clearway.rooms.plans.named import NAMED
from clearway.rooms.plans.pieces import ANYWHERE, BY_USE, FIRST, LAST_RESORT, THEMES, furnish
from clearway.rooms.plans.placing import Kind
from clearway.rooms.room import Room
from clearway.scenes.floor_plans import FURNITURE, USES, Area
from helpers.plan_maps import COARSE

ALL = (*THEMES, *BY_USE.values(), *NAMED.values(), ANYWHERE, (LAST_RESORT,))
KINDS = sorted({kind for kinds in ALL for kind in kinds}, key=lambda kind: str(kind))
NEAREST_M = 0.35
MIDDLE_M = 5.0


def room_with(pieces: list[Piece], seed: int = 0, *, looks: bool = False) -> tuple[Room, list[float]]:
    room = Room("any", 2 * MIDDLE_M, 2 * MIDDLE_M, 2.6, (0.5, 0.5), seed, looks, detail=COARSE)
    return room, furnish(room, pieces, NEAREST_M)


def place(width_m: float, depth_m: float, back_at_wall: bool = False) -> Piece:
    return Piece(Frame(MIDDLE_M, MIDDLE_M), width_m, depth_m, back_at_wall)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.place.__name__)
def test_every_kind_fills_its_place_and_is_as_high_as_it_says(kind: Kind) -> None:
    for end in (0, 1):
        size_m = [max(0.1, min(side[end], 3.0)) for side in (kind.widths_m, kind.depths_m)]
        room = Room("any", 2 * MIDDLE_M, 2 * MIDDLE_M, 2.6, (0.5, 0.5))
        kind.place(room, Frame(MIDDLE_M, MIDDLE_M), *size_m)
        for geom in room.spec.geoms:
            if geom.group == OBSTACLE_GROUP:
                turned = np.abs(rotation(np.array(geom.quat))[:2, :2])
                reach_m = np.abs(geom.pos[:2] - MIDDLE_M) + turned @ geom.size[:2]
                assert (reach_m <= np.array(size_m) / 2 + 1e-6).all()
        tops_m, reaches_m = [], []
        for part in room.parts:
            corners_m = part.mesh.vertices_m @ part.rotation.T + part.position_m
            tops_m.append(corners_m[:, 2].max())
            if part.material not in ("leaf", "young leaf"):
                reaches_m.append(np.abs(corners_m[:, :2] - MIDDLE_M).max(axis=0))
        assert kind.top_m - 0.1 < max(tops_m) < 2.6 + 0.01
        low = 0.3 if min(size_m) > 0.3 else 0.0  # smaller ones are narrower than the knick-knacks on them
        assert (np.max(reaches_m, axis=0) > low * np.array(size_m)).all()


def test_what_stands_in_a_place_can_be_seen_from_beside_it() -> None:
    for seed in range(12):
        for depth_m in (0.2, 0.5, 0.8, 1.4):
            _, (top_m,) = room_with([place(1.4, depth_m)], seed)
            seen_at_m = NEAREST_M + min(1.4, depth_m) / 2
            assert top_m >= 1.0 - seen_at_m * math.tan(math.radians(30))


def test_there_is_one_bed_at_most() -> None:
    for seed in range(3):
        room, tops_m = room_with([place(1.5, 0.5, True)] * 6 + [place(1.6, 2.0, True)] * 3, seed, looks=True)
        assert len(tops_m) == 9
        covers = sum(part.material == "duvet" for part in room.parts)
        assert covers <= 1


def test_a_place_that_nothing_fits_gets_a_cupboard() -> None:
    _, tops_m = room_with([place(5.0, 4.0)])
    assert tops_m == [LAST_RESORT.top_m]


def test_every_use_has_furniture_of_its_own() -> None:
    assert set(BY_USE) == set(USES)
    for use, kinds in BY_USE.items():
        area = Area(use, (0, 0), (9, 9))
        places = [replace(place(1.5, 0.5, True), area=area)] * 6
        _, tops_m = room_with(places)
        assert set(tops_m) <= {kind.top_m for kind in kinds}, use


@pytest.mark.parametrize(("use", "material"), [("bathroom", "porcelain"), ("bedroom", "duvet"), ("kitchen", "granite")])
def test_what_makes_a_room_of_a_use_is_in_each_area_once(use: str, material: str) -> None:
    areas = [Area(use, (0, 0), (4, 4)), Area(use, (5, 0), (9, 4))]
    sizes_m = [(1.6, 0.5), (1.6, 1.0), (1.6, 2.0)]
    places = [replace(place(*size_m, True), area=area) for area in areas for size_m in sizes_m]
    for seed in range(4):
        room, tops_m = room_with(places, seed, looks=True)
        firsts = [top_m in {kind.top_m for kind in FIRST[use]} for top_m in tops_m]
        assert any(firsts[:3]) and any(firsts[3:])
        assert any(part.material == material for part in room.parts)


def test_every_bedroom_has_a_bed_and_one_only() -> None:
    areas = [Area("bedroom", (0, 0), (4, 4)), Area("bedroom", (5, 0), (9, 4))]
    room, _ = room_with([replace(place(1.6, 2.0, True), area=area) for area in areas for _ in range(2)], looks=True)
    assert sum(part.material == "duvet" for part in room.parts) == 2


KEY_MATERIALS = {
    "double bed": {"duvet"},
    "single bed": {"duvet"},
    "toilet": {"porcelain"},
    "basin": {"porcelain"},
    "bath": {"porcelain", "water"},
    "shower": {"porcelain", "glass"},
    "counter": {"granite", "steel", "black"},
    "sofa": {"walnut", "accent"},
    "coffee table": {"wood"},
    "television": {"walnut", "black"},
}


def test_furniture_that_a_plan_names_is_drawn_where_it_says() -> None:
    assert set(NAMED) == set(FURNITURE)
    for kind, materials in KEY_MATERIALS.items():
        named = NAMED[kind][0]
        size_m = (sum(side) / 2 for side in (named.widths_m, named.depths_m))
        room, tops_m = room_with([replace(place(*size_m, True), kind=kind)], looks=True)
        assert materials <= {part.material for part in room.parts}, kind
        assert tops_m[0] in {one.top_m for one in NAMED[kind]}


@pytest.mark.slow
def test_rooms_between_walls_have_themes_of_their_own() -> None:
    def themes_in(seed: int) -> set[bool]:
        rooms = []
        for number in (1, 2, 3):
            before = [replace(place(1.2, 0.5, True), room=earlier) for earlier in range(1, number)]
            room, _ = room_with([*before, *[replace(place(1.2, 0.5, True), room=number)] * 9], seed, looks=True)
            rooms.append(any(part.material == "granite" for part in room.parts))
        return set(rooms)

    assert {True, False} in [themes_in(seed) for seed in range(6)]


def test_furniture_without_areas_stays_as_it_was() -> None:
    places = [place(1.2, 0.5, True), place(0.8, 0.8), place(1.6, 1.6, True), place(0.3, 0.3)] * 3
    assert room_with(places, 3)[1] == [0.9, 0.75, 1.25, 2.6, 1.9, 0.75, 1.25, 2.6, 2.0, 0.75, 1.25, 1.01]


def test_the_seed_repeats_and_another_differs() -> None:
    places = [place(1.2, 0.5, True)] * 8
    assert room_with(places, 3)[1] == room_with(places, 3)[1]
    assert len({tuple(room_with(places, seed)[1]) for seed in range(6)}) > 1
