"""The frozen test split: 100 rooms and 50 flats of seed 0, and one hash over their plans."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable

from clearway.generation.request import Request
from clearway.scenes.floor_plans import FloorPlan

TEST_SEED = 0
TEST_ROOMS, TEST_FLATS = 100, 50
TEST_HASH = "43f8f64f60000a13c3f76e573ae58ea5a30fded306b3d2a55667cc17c7afc5f4"
"""Of `plans_hash` over the plans of `frozen_requests`. It changes only with `GENERATOR_VERSION`."""


def frozen_requests() -> list[Request]:
    """The plans that agents are compared on."""
    rooms = [Request("room", "test", TEST_SEED, number) for number in range(TEST_ROOMS)]
    return rooms + [Request("flat", "test", TEST_SEED, number) for number in range(TEST_FLATS)]


def plans_hash(plans: Iterable[FloorPlan]) -> str:
    """SHA-256 over names, cells, walls, doors, areas and furniture of plans in their order, as hexadecimal digits."""
    digest = hashlib.sha256()
    for plan in plans:
        parts = {
            "name": plan.name,
            "cell_size_m": plan.cell_size_m,
            "cells": plan.cells.tolist(),
            "walls": plan.walls.tolist(),
            "doors": plan.doors.tolist(),
            "areas": [[area.use, list(area.low), list(area.high)] for area in plan.areas],
            "furniture": [[one.kind, list(one.low), list(one.high), one.front] for one in plan.furniture],
        }
        digest.update(json.dumps(parts, sort_keys=True).encode())
    return digest.hexdigest()
