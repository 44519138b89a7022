"""Which floor plans become rooms with pictures. Needs no MuJoCo."""

from __future__ import annotations

import numpy as np

from clearway.errors import SceneError
from clearway.rooms.plans.cell_map import cell_map
from clearway.scenes.floor_plans import FloorPlan

CELL_SIZES_M = (0.2, 2.0)  # below, the camera would look through walls; above, the agent would be wider than high
MAX_RENDERED_CELLS = 2048  # 8,192 pictures, 3 GB
MAX_SIDE_M = 40.0  # the floor is one texture
MAX_FLOOR_M2 = 400.0
MAX_ROOMS = 40  # each of them has a lamp


def check_can_be_rendered(plan: FloorPlan, seed: int) -> None:
    """Check that a plan and a seed make a room.

    Raises:
        SceneError: the plan's cells, their number or its extent are no room's, it has too many rooms between its walls,
            a door is in no wall, or the seed is negative.
    """
    lowest, highest = CELL_SIZES_M
    width_m, depth_m = _extent_m(plan)
    if seed < 0:
        problem = f"the seed must be 0 or more, found {seed}"
    elif not lowest <= plan.cell_size_m <= highest:
        problem = f"has cells of {plan.cell_size_m} m, those of {lowest} to {highest} m can be rendered"
    elif len(plan.cells) > MAX_RENDERED_CELLS:
        problem = f"has {len(plan.cells)} reachable cells, {MAX_RENDERED_CELLS} can be rendered"
    elif max(width_m, depth_m) > MAX_SIDE_M or width_m * depth_m > MAX_FLOOR_M2:
        most = f"{MAX_SIDE_M:.0f} m to a side and {MAX_FLOOR_M2:.0f} square metres"
        problem = f"spans {width_m:.1f} x {depth_m:.1f} m, {most} can be rendered"
    elif (room_count := int(cell_map(plan).rooms.max()) if plan.has_walls else 1) > MAX_ROOMS:
        problem = f"has {room_count} rooms between its walls, {MAX_ROOMS} can be lit"
    else:
        return
    remedy = "Choose another seed" if seed < 0 else "Give another plan, or take made-up features instead of pictures"
    raise SceneError(plan.source or plan.name, problem, remedy, plan.dataset)


def _extent_m(plan: FloorPlan) -> tuple[float, float]:
    """Size of the smallest rectangle around the cells and walls."""
    cells = np.concatenate([plan.cells, plan.walls]).astype(np.int64)
    width, depth = np.ptp(cells, axis=0) + 1
    return float(width * plan.cell_size_m), float(depth * plan.cell_size_m)
