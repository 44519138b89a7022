"""Generated plans as rooms: their obstacles, and that nothing that is seen reaches through a wall."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.rooms.plans import decoration, plan_room
from clearway.rooms.plans.layout import Layout
from clearway.rooms.room import Room
from helpers.plan_maps import COARSE

THROUGH_M = 0.05  # covers of door frames in corners reach 4 cm into the wall beside them
KEPT_LOW_M = 0.05  # skirting boards meet in corners


def through_walls_m(room: Room, layout: Layout) -> float:
    """How far any part reaches into a wall."""
    deepest_m = 0.0
    for part in room.parts:
        reach_m = np.abs(part.rotation @ np.diag(part.half_extents_m)).sum(axis=1)
        low, high = part.centre_m - reach_m, part.centre_m + reach_m
        if part.material in ("", "trim", "beyond") or high[2] < KEPT_LOW_M:
            continue
        beyond_m = [*-low[:2], *(high[:2] - (layout.width_m, layout.depth_m))]
        for wall in layout.walls:
            beyond_m.append(
                np.minimum(high[:2] - (wall.x_min_m, wall.y_min_m), (wall.x_max_m, wall.y_max_m) - low[:2]).min()
            )
        deepest_m = max(deepest_m, *beyond_m)
    return deepest_m


@pytest.mark.parametrize(("kind", "number"), [("flat", 2), *(("room", number) for number in range(4))])
def test_nothing_reaches_through_walls_and_all_furniture_is_named(monkeypatch, kind, number) -> None:
    monkeypatch.setattr(plan_room, "bake", lambda *arguments, **options: None)
    room, layout = plan_room.build_plan_room(generated_plan(Request(kind, "train", 4, number)), detail=COARSE)
    assert all(piece.kind is not None for piece in layout.pieces)
    assert len(room.parts) > 80 and 0 < through_walls_m(room, layout) < THROUGH_M


@pytest.mark.slow
def test_every_flat_has_a_way_in_and_windows(monkeypatch) -> None:
    doors = []
    entrance = decoration._entrance
    monkeypatch.setattr(decoration, "_entrance", lambda layout: doors.append(entrance(layout)) or doors[-1])
    for number in range(8):
        room, _ = plan_room.build_plan_room(generated_plan(Request("flat", "train", 4, number)), looks=False)
        assert doors[-1] is not None and doors[-1].area.use == "corridor"
        assert len(room.windows) >= 2
