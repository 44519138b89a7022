from dataclasses import replace

import numpy as np
import pytest

from clearway.rooms.furniture import openings
from clearway.rooms.plans.decoration import MOST_BEHIND_M, MOST_WINDOWS, decorate
from clearway.rooms.plans.layout import Layout, lay_out
from clearway.rooms.plans.walls import GAP
from clearway.rooms.room import Room
from clearway.scenes.floor_plans import Area, FloorPlan, Furnishing
from helpers.plan_maps import COARSE, ELL, plan_of, walled

PLAN = plan_of("ell", ELL)


FOUR_ROOMS = walled(
    "flat",
    (
        "WWWWWWWWWWWWW",
        "W.....W.....W",
        "W.....W.....W",
        "W.....W.....W",
        "WWDWWWWWWDWWW",
        "W...........W",
        "WWDWWWWWWDWWW",
        "W....W......W",
        "W....W......W",
        "W....W......W",
        "WWWWWWWWWWWWW",
    ),
    (Area("corridor", (1, 5), (11, 5)), Area("bathroom", (1, 1), (4, 3))),
)


def decorated(top_m: float, seed: int = 0, plan: FloorPlan = PLAN) -> tuple[Room, Layout]:
    layout = lay_out(plan, np.random.default_rng(seed))
    room = Room("ell", layout.width_m, layout.depth_m, 2.6, (0.35, 0.35), seed, detail=COARSE)
    decorate(room, layout, [top_m] * len(layout.pieces))
    return room, layout


@pytest.mark.parametrize("seed", range(4))
def test_windows_are_in_the_outer_walls_over_furniture_or_free_floor(seed: int) -> None:
    room, layout = decorated(0.9, seed)
    assert 1 <= len(room.windows) <= MOST_WINDOWS
    for window in room.windows:
        x_m, y_m, z_m = window.centre_m
        assert min(abs(gap) for gap in (x_m, y_m, layout.width_m - x_m, layout.depth_m - y_m)) < 1e-6
        assert z_m - window.height_m / 2 > 0.89


def test_nothing_hangs_behind_high_furniture() -> None:
    low, layout = decorated(0.9)
    high, _ = decorated(MOST_BEHIND_M + 0.1)
    assert len(high.parts) < len(low.parts)
    backs = [stretch for stretch in layout.stretches if stretch.piece is not None and stretch.outer]
    hung = [part for part in high.parts if 0.3 < part.position_m[2] < 2.3]
    for stretch in backs:
        for part in hung:
            along_m, off_m, _ = np.linalg.solve(axes(stretch.at), part.position_m - stretch.at.point(0, 0, 0))
            assert not (abs(along_m) < stretch.length_m / 2 - 0.2 and abs(off_m) < 0.1)


def axes(frame) -> np.ndarray:
    """The frame's directions as columns, (3, 3)."""
    return np.stack([frame.point(*unit) - frame.point(0, 0, 0) for unit in np.eye(3)], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_every_room_between_walls_has_a_lamp_and_a_window(seed: int) -> None:
    room, layout = decorated(0.9, seed, FOUR_ROOMS)
    assert layout.rooms.max() == 5
    corridor = int(layout.rooms[0, 4])
    for things, rooms in ((room.lamps, {1, 2, 3, 4, 5}), (room.windows, {1, 2, 3, 4, 5} - {corridor})):
        places = [np.asarray(thing.centre_m)[:2] / layout.cell_size_m - GAP for thing in things]
        cells = [tuple(np.clip(place, 0, np.array(layout.rooms.shape) - 1).astype(int)) for place in places]
        assert {int(layout.rooms[cell]) for cell in cells} == rooms
    assert all(window.width_m > 0.55 for window in room.windows)  # rather without curtains than too narrow
    for window in room.windows:
        x_m, y_m, _ = window.centre_m
        assert min(abs(gap) for gap in (x_m, y_m, layout.width_m - x_m, layout.depth_m - y_m)) < 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_nothing_on_a_wall_reaches_into_another_or_into_a_doorway(seed: int) -> None:
    room, layout = decorated(0.9, seed, FOUR_ROOMS)
    hung = [part for part in room.parts if 0.5 < part.centre_m[2] < 2.2]
    assert len(hung) > 40
    for part in hung:
        reach_m = np.abs(part.rotation[:2] @ np.diag(part.half_extents_m)).sum(axis=1)
        low, high = part.centre_m[:2] - reach_m, part.centre_m[:2] + reach_m
        for wall in layout.walls:
            beyond_m = np.minimum(high - (wall.x_min_m, wall.y_min_m), (wall.x_max_m, wall.y_max_m) - low)
            assert beyond_m.min() < 0.03, part.material
        for doorway in layout.doorways:
            half_m = np.array([doorway.width_m, doorway.depth_m])[:: 1 if doorway.at.yaw_deg == 0 else -1] / 2
            middle_m = np.array([doorway.at.x_m, doorway.at.y_m])
            apart_m = np.maximum(low - middle_m, middle_m - high) - half_m
            assert apart_m.max() > -0.03, part.material


def test_the_front_door_is_in_an_outer_wall(monkeypatch) -> None:
    at = []
    monkeypatch.setattr(openings, "door", lambda room, frame: at.append(frame))
    for seed in range(3):
        _, layout = decorated(
            0.9, seed, walled("one", ("WWWWWWWWW", "W.......W", "W.WWWWW.W", "W.......W", "WWWWWWWWW"))
        )
        frame = at.pop()
        gaps = frame.x_m, frame.y_m, layout.width_m - frame.x_m, layout.depth_m - frame.y_m
        assert min(np.abs(gaps)) < 1e-6 and not at


def test_the_front_door_is_in_the_corridor_if_there_is_one(monkeypatch) -> None:
    at = []
    monkeypatch.setattr(openings, "door", lambda room, frame: at.append(frame))
    lines = ("WWWWWWWWWW", "W........W", "W........W", "WWDWWWWWWW", "W........W", "W........W", "WWWWWWWWWW")
    decorated(0.9, 0, walled("flat", lines, (Area("bedroom", (1, 1), (8, 2)), Area("corridor", (1, 4), (8, 5)))))
    (frame,) = at
    assert frame.y_m > 1.6  # the corridor's two rows of cells, of 2.7 m in all


def test_lamps_hang_over_free_cells() -> None:
    room, layout = decorated(0.9)
    free_m = layout.middles_m(np.argwhere(layout.free))
    assert len(room.lamps) >= 1
    for lamp in room.lamps:
        assert np.linalg.norm(free_m - lamp.centre_m[:2], axis=1).min() < 1e-6


def furnished_plan(number: int) -> FloorPlan:
    """A plan that names a piece of furniture."""
    lines = ("WWWWWWWW", "W......W", "W......W", "W.##...W", "WWWWWWWW")
    return replace(walled(f"room {number}", lines), furniture=(Furnishing("sofa", (2, 1), (3, 1), "north"),))


@pytest.mark.slow
def test_lamps_of_plans_that_name_their_furniture_differ() -> None:
    lamps = [decorated(0.9, seed, furnished_plan(0))[0].lamps[0] for seed in range(30)]
    assert len({tuple(lamp.colour) for lamp in lamps}) == 3
    assert len({round(float(lamp.centre_m[2]), 3) for lamp in lamps}) >= 3
    assert len({tuple(lamp.colour) for lamp in decorated(0.9, 3, FOUR_ROOMS)[0].lamps}) == 1
