from collections import Counter

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.generation import plans
from clearway.generation.plans import ROOM_LIMITS, draw_plan, generated_plan, is_like_real_rooms, turned
from clearway.generation.request import KINDS, ROOM_USES, SPLITS, Request
from clearway.generation.statistics import plan_statistics
from clearway.rooms.plans.buildable import check_can_be_rendered
from clearway.scenes.floor_plans import Area
from clearway.scenes.grid import connected_parts

ROOMS = [Request("room", "train", 3, number) for number in range(12)]
FLATS = [Request("flat", "train", 3, number) for number in range(12)]


def rows(cells: np.ndarray) -> set[tuple[int, int]]:
    return {(x, z) for x, z in cells.tolist()}


def cells_of(area: Area) -> set[tuple[int, int]]:
    return {(x, z) for x in range(area.low[0], area.high[0] + 1) for z in range(area.low[1], area.high[1] + 1)}


@pytest.mark.parametrize("request_", [*ROOMS, *FLATS], ids=lambda one: one.name)
def test_a_plan_is_one_part_within_walls(request_: Request) -> None:
    plan = generated_plan(request_)
    free, walls = rows(plan.cells), rows(plan.walls)
    _, sizes = connected_parts(len(plan.cells), plan.edges)
    assert sizes == (len(free),)
    assert plan.cell_size_m == 0.5 and plan.name == request_.name
    width, depth = np.max(plan.walls, axis=0) + 1
    border = {(x, z) for x in range(width) for z in range(depth) if x in (0, width - 1) or z in (0, depth - 1)}
    assert border <= walls
    inside = set().union(*map(cells_of, plan.areas)) | rows(plan.doors)
    assert free <= inside and rows(plan.doors) <= free
    everywhere = {(x, z) for x in range(width) for z in range(depth)}
    if request_.kind == "flat":
        assert walls == everywhere - inside
    check_can_be_rendered(plan, request_.seed)


@pytest.mark.parametrize("request_", FLATS, ids=lambda one: one.name)
def test_a_flat_has_rooms_of_known_uses_with_a_door_each(request_: Request) -> None:
    plan = generated_plan(request_)
    rooms = [area for area in plan.areas if area.use != "corridor"]
    uses = Counter(area.use for area in rooms)
    assert 2 <= len(rooms) <= 6 and len(rooms) == len(plan.areas) - 1
    assert uses["living room"] == 1 and uses["bathroom"] >= 1
    free, doors = rows(plan.cells), rows(plan.doors)
    for area in plan.areas:
        inside = cells_of(area)
        beside = {(x + dx, z + dz) for x, z in inside & free for dx, dz in ((0, 1), (1, 0), (0, -1), (-1, 0))}
        assert len(inside & free) >= 6
        assert beside & doors, f"no door to the {area.use}"
        for other in plan.areas:
            if other is not area:  # a wall of one cell at least between them
                gaps = [max(other.low[i] - area.high[i], area.low[i] - other.high[i]) for i in (0, 1)]
                assert max(gaps) >= 2


@pytest.mark.parametrize("request_", ROOMS, ids=lambda one: one.name)
def test_a_room_lies_within_the_real_rooms_ranges(request_: Request) -> None:
    plan = generated_plan(request_)
    found = plan_statistics(plan).to_json()
    assert all(low <= found[name] <= high for name, (low, high) in ROOM_LIMITS.items()), found
    (area,) = plan.areas
    assert area.use == ROOM_USES[request_.number % 4] and len(plan.doors) == 0


def test_a_room_unlike_real_ones_is_drawn_again(monkeypatch) -> None:
    monkeypatch.setitem(ROOM_LIMITS, "cells", (11, 25))
    drawn = draw_plan(Request("room", "train", 0, 1))
    assert 11 <= len(drawn.plan.cells) <= 25
    assert drawn.rejected["unlike"] > 0
    figures = plan_statistics(drawn.plan)
    assert is_like_real_rooms(figures)
    monkeypatch.setitem(ROOM_LIMITS, "cells", (0, 1))
    assert not is_like_real_rooms(figures)


def test_what_cannot_be_drawn_is_one_line(monkeypatch) -> None:
    monkeypatch.setitem(ROOM_LIMITS, "cells", (0, 1))
    monkeypatch.setattr(plans, "MOST_ATTEMPTS", 3)
    with pytest.raises(ClearwayError, match=r"room-train-000000-kitchen: no plan in 3 attempts"):
        generated_plan(Request("room", "train", 0, 0))


def test_the_same_request_gives_the_same_plan_and_others_another() -> None:
    one, again = generated_plan(ROOMS[0]), generated_plan(ROOMS[0])
    np.testing.assert_array_equal(one.cells, again.cells)
    np.testing.assert_array_equal(one.walls, again.walls)
    assert one.areas == again.areas
    others = (Request("room", "train", 3, 4), Request("room", "train", 4, 0), Request("room", "test", 3, 0))
    assert all(rows(generated_plan(other).cells) != rows(one.cells) for other in others)


def test_no_two_requests_draw_the_same_numbers() -> None:
    requests = [
        Request(kind, split, seed, number) for kind in KINDS for split in SPLITS for seed in (0, 1) for number in (0, 1)
    ]
    firsts = {int(request.random(attempt).integers(2**62)) for request in requests for attempt in (0, 1)}
    assert len(firsts) == 2 * len(requests)
    assert len({request.name for request in requests}) == len(requests)


@pytest.mark.parametrize("way", range(8))
def test_a_draft_is_turned_whole(way: int) -> None:
    draft = plans.draw_flat(np.random.default_rng(5))
    assert draft is not None
    other = turned(draft, way)
    assert other.free.sum() == draft.free.sum() and other.inside.sum() == draft.inside.sum()
    assert other.free[tuple(other.doors.T)].all()
    for area, before in zip(other.areas, draft.areas, strict=True):
        (x0, z0), (x1, z1) = area.low, area.high
        (a0, b0), (a1, b1) = before.low, before.high
        assert other.free[x0 : x1 + 1, z0 : z1 + 1].sum() == draft.free[a0 : a1 + 1, b0 : b1 + 1].sum()
        assert other.inside[x0 : x1 + 1, z0 : z1 + 1].all()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("house", "train", 0, 0), "kind 'house'.*room, flat"),
        (("room", "dev", 0, 0), "split 'dev'.*train, validation, test"),
        (("room", "train", -1, 0), "seed -1"),
        (("room", "train", 0, 1_000_000), "number 1000000"),
    ],
)
def test_an_impossible_request_is_one_line(arguments, said) -> None:
    with pytest.raises(ClearwayError, match=said):
        Request(*arguments)


def test_names_say_what_a_plan_is() -> None:
    assert Request("room", "train", 0, 17).name == "room-train-000017-living_room"
    assert Request("flat", "test", 0, 3).name == "flat-test-000003"
    assert Request("flat", "test", 9, 3).name == "flat-test-000003-9"
