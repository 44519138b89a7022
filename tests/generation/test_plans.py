from collections import Counter

import numpy as np
import pytest

from clearway.errors import ClearwayError
from clearway.generation import plans
from clearway.generation.blocks import FORMS
from clearway.generation.plans import ROOM_LIMITS, Draft, draw_plan, generated_plan, is_like_real_rooms, turned
from clearway.generation.request import KINDS, ROOM_USES, SPLITS, Request
from clearway.generation.statistics import plan_statistics
from clearway.generation.structure import Structure, draw_structure
from clearway.rooms.plans.buildable import check_can_be_rendered
from clearway.scenes.floor_plans import Area, FloorPlan, Furnishing
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
    named = [cell for piece in plan.furniture for cell in piece.cells]
    assert len(named) == len(set(named)) and not set(named) & (free | walls)
    assert set(named) | free | walls == {(x, z) for x in range(width) for z in range(depth)}
    inside = set().union(*map(cells_of, plan.areas)) | rows(plan.doors)
    assert free <= inside and rows(plan.doors) <= free
    everywhere = {(x, z) for x in range(width) for z in range(depth)}
    if request_.kind == "flat":
        assert walls == everywhere - inside
    check_can_be_rendered(plan, request_.seed)


@pytest.mark.parametrize("request_", FLATS, ids=lambda one: one.name)
def test_a_flat_has_rooms_of_known_uses_that_are_reached_through_doors(request_: Request) -> None:
    plan = generated_plan(request_)
    free, doors = rows(plan.cells), rows(plan.doors)
    rooms = [
        {(x, z) for x, z in part.tolist()}
        for part in FloorPlan("rooms", np.array(sorted(free - doors)), cell_size_m=0.5).parts
    ]
    uses = [{area.use for area in plan.areas if cells_of(area) & room} for room in rooms]
    assert 2 <= len(rooms) <= 7 and sum("corridor" in use for use in uses) == 1
    assert sum("living room" in use for use in uses) == 1 and any("bathroom" in use for use in uses)
    for room, use in zip(rooms, uses, strict=True):
        assert len(use) == 1 or use == {"living room", "kitchen"}
        assert len(room) >= 6
        assert {beside for cell in room for beside in neighbours(cell)} & doors, f"no door to the {use}"
    for door in doors:
        assert len({index for index, room in enumerate(rooms) if room & neighbours(door)}) == 2 or any(
            other in doors for other in neighbours(door)
        ), "a door leads from one room to another"


def neighbours(cell: tuple[int, int]) -> set[tuple[int, int]]:
    x, z = cell
    return {(x + 1, z), (x - 1, z), (x, z + 1), (x, z - 1)}


def test_flats_have_corridors_and_rooms_of_many_shapes() -> None:
    drawn = [draw_structure(np.random.default_rng(seed)) for seed in range(150)]
    flats = [one for one in drawn if one is not None]
    assert len(flats) > 140
    assert {flat.form for flat in flats} == set(FORMS)
    counts = Counter(len(flat.uses) - 1 for flat in flats)
    assert set(counts) == {2, 3, 4, 5, 6} and min(counts.values()) > 10
    full = Counter[str]()
    for flat in flats:
        for number, use in enumerate(flat.uses, 1):
            cells = np.argwhere(flat.numbers == number)
            full[use, len(cells) == (np.ptp(cells, axis=0) + 1).prod()] += 1
    for use in ("living room", "bedroom"):
        assert full[use, False] > 0.25 * full[use, True]  # an L, a niche, a breast
    opened = [flat for flat in flats if "kitchen" in flat.uses and are_one_room(flat)]
    assert 10 < len(opened) < 60


def are_one_room(flat: Structure) -> bool:
    """Whether no wall is between kitchen and living room."""
    kitchen, living = (flat.numbers == flat.uses.index(use) + 1 for use in ("kitchen", "living room"))
    beside = np.pad(kitchen, 1)
    return bool(((beside[2:, 1:-1] | beside[:-2, 1:-1] | beside[1:-1, 2:] | beside[1:-1, :-2]) & living).any())


KEY_PIECES = {
    "bathroom": ({"toilet", "basin"}, {"bath", "shower"}),
    "kitchen": ({"counter"},),
    "bedroom": ({"double bed", "single bed"},),
    "living room": ({"sofa"}, {"coffee table", "dining table", "table"}),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_room_of_fifty_has_what_makes_it_one(kind) -> None:
    for number in range(50):
        plan = generated_plan(Request(kind, "train", 5, number))
        blocked = {cell for piece in plan.furniture for cell in piece.cells}
        assert not blocked & (rows(plan.cells) | rows(plan.walls))
        held = Counter[tuple[str, int]]()
        for use in {area.use for area in plan.areas} & set(KEY_PIECES):
            inside = set().union(*(cells_of(area) for area in plan.areas if area.use == use))
            kinds = Counter(piece.kind for piece in plan.furniture if set(piece.cells) <= inside)
            rooms = 1 if kind == "room" else rooms_of(use, plan)
            for group, wanted in enumerate(KEY_PIECES[use]):
                held[use, group] = sum(kinds[one] for one in wanted)
                assert held[use, group] >= rooms, (plan.name, use, wanted, kinds)


def rooms_of(use: str, plan: FloorPlan) -> int:
    """How many rooms of a use a flat has: groups of its areas that touch."""
    cells = np.array(sorted(set().union(*(cells_of(area) for area in plan.areas if area.use == use))))
    return len(FloorPlan("areas", cells, cell_size_m=0.5).parts)


@pytest.mark.parametrize("request_", ROOMS, ids=lambda one: one.name)
def test_a_room_lies_within_the_real_rooms_ranges(request_: Request) -> None:
    plan = generated_plan(request_)
    found = plan_statistics(plan).to_json()
    assert all(low <= found[name] <= high for name, (low, high) in ROOM_LIMITS.items()), found
    (area,) = plan.areas
    assert area.use == ROOM_USES[request_.number % 4] and len(plan.doors) == 0


@pytest.mark.slow
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
    assert one.areas == again.areas and one.furniture == again.furniture
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
    for piece, before in zip(other.furniture, draft.furniture, strict=True):
        assert len(piece.cells) == len(before.cells) and not any(other.free[cell] for cell in piece.cells)
        assert looks_at(other, piece) == looks_at(draft, before)


def looks_at(draft: Draft, piece: Furnishing) -> list[bool]:
    """Which of the cells just before a piece are free, in whatever order."""
    dx, dz = {"south": (0, -1), "north": (0, 1), "west": (-1, 0), "east": (1, 0)}[piece.front]
    ahead = {(x + dx, z + dz) for x, z in piece.cells} - set(piece.cells)
    free = np.pad(draft.free, 1)
    return sorted(bool(free[x + 1, z + 1]) for x, z in ahead)


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
