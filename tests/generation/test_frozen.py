from dataclasses import replace

import numpy as np
import pytest

from clearway.generation.frozen import TEST_FLATS, TEST_HASH, TEST_ROOMS, frozen_requests, plans_hash
from clearway.generation.plans import generated_plan
from clearway.generation.request import GENERATOR_VERSION, Request
from clearway.generation.split import canonical_hash
from clearway.scenes.floor_plans import FloorPlan

FIRST_HASH = "30c14a2d017733e464209f47428026a1a77c505df316fbe1324515eb97040c28"


@pytest.mark.slow
def test_the_first_plans_of_the_test_split_never_change() -> None:
    """Nor does any other, which takes longer to see."""
    plans = [generated_plan(request) for request in frozen_requests() if request.number < 5]
    assert len(plans) == 10 and GENERATOR_VERSION == 2
    assert plans_hash(plans) == FIRST_HASH


@pytest.mark.slow
def test_the_test_split_never_changes() -> None:
    """Another hash needs another GENERATOR_VERSION."""
    requests = frozen_requests()
    assert (TEST_ROOMS, TEST_FLATS) == (100, 50) and len(requests) == 150
    assert {request.split for request in requests} == {"test"} and {request.seed for request in requests} == {0}
    plans = [generated_plan(request) for request in requests]
    assert GENERATOR_VERSION == 2 and plans_hash(plans) == TEST_HASH
    assert len({canonical_hash(plan.cells) for plan in plans}) == 148  # two pairs of rooms have the same cells
    assert len({(canonical_hash(plan.cells), furniture_of(plan)) for plan in plans}) == 150


def furniture_of(plan: FloorPlan) -> tuple[tuple[str, int], ...]:
    """Kind and size of each piece, however the plan is turned."""
    return tuple(sorted((piece.kind, len(piece.cells)) for piece in plan.furniture))


def test_the_hash_covers_all_of_a_plan() -> None:
    plan = generated_plan(Request("flat", "train", 0, 0))
    others = [
        replace(plan, name="another"),
        replace(plan, cells=plan.cells[1:], doors=np.zeros((0, 2), int)),
        replace(plan, walls=plan.walls[1:]),
        replace(plan, doors=plan.doors[1:]),
        replace(plan, areas=plan.areas[1:]),
        replace(plan, furniture=plan.furniture[1:]),
    ]
    assert len({plans_hash([one]) for one in (plan, *others)}) == 7
