from dataclasses import replace

import numpy as np

from clearway.generation.frozen import TEST_FLATS, TEST_HASH, TEST_ROOMS, frozen_requests, plans_hash
from clearway.generation.plans import generated_plan
from clearway.generation.request import GENERATOR_VERSION, Request
from clearway.generation.split import canonical_hash


def test_the_test_split_never_changes() -> None:
    """Another hash needs another GENERATOR_VERSION."""
    requests = frozen_requests()
    assert (TEST_ROOMS, TEST_FLATS) == (100, 50) and len(requests) == 150
    assert {request.split for request in requests} == {"test"} and {request.seed for request in requests} == {0}
    plans = [generated_plan(request) for request in requests]
    assert GENERATOR_VERSION == 1 and plans_hash(plans) == TEST_HASH
    assert len({canonical_hash(plan.cells) for plan in plans}) == 150


def test_the_hash_covers_all_of_a_plan() -> None:
    plan = generated_plan(Request("flat", "train", 0, 0))
    others = [
        replace(plan, name="another"),
        replace(plan, cells=plan.cells[1:], doors=np.zeros((0, 2), int)),
        replace(plan, walls=plan.walls[1:]),
        replace(plan, doors=plan.doors[1:]),
        replace(plan, areas=plan.areas[1:]),
    ]
    assert len({plans_hash([one]) for one in (plan, *others)}) == 6
