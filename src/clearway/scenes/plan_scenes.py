"""Floor plans as scenes, with made-up features, and the plans of scenes that were made of them.

Axis letters: S poses, F features, A actions.
"""

from __future__ import annotations

import zlib

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.floor_plans import SOURCE, Area, FloorPlan, Furnishing
from clearway.scenes.grid import HEADING_COUNT, neighbour_pairs, pose_graph
from clearway.scenes.made_up import check_made_up, made_up_encoder, made_up_features
from clearway.scenes.scene import Provenance, Scene
from clearway.version import __version__

PLAN_NOTE = "plan"  # in a scene's notes: walls, doors, areas and furniture
REBUILD = "Make the scene of its plan again"


def plan_poses(plan: FloorPlan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The poses of a plan, four headings a cell, in the order of its cells.

    Returns:
        locations_m: (S, 2) float64, x and z.
        headings_deg: (S,) int64.
        graph: (S, A) int32, next state by action; -1 where the move is blocked.
    """
    cells = plan.cells.astype(np.int64)
    locations_m = np.repeat(cells, HEADING_COUNT, axis=0) * plan.cell_size_m
    headings_deg = np.tile(np.arange(HEADING_COUNT) * 360 // HEADING_COUNT, len(cells))
    return locations_m, headings_deg, pose_graph(cells, plan.edges)


def floor_plan_scene(plan: FloorPlan, feature_count: int = 2048, seed: int = 0) -> Scene:
    """A plan as a scene without pictures: its cells and edges exactly, four headings, made-up features.

    Scenes of the same feature count and seed can be trained together; each plan has its own features, by its name.

    Args:
        plan: the plan. Parts of it that cannot be reached from each other stay in the scene.
        feature_count: F.
        seed: of the features (`made_up`).

    Raises:
        SceneError: the seed is negative, or so many features cannot be kept.
    """
    state_count = HEADING_COUNT * len(plan.cells)
    check_made_up(feature_count, seed, state_count, plan.source or plan.name)
    locations_m, headings_deg, graph = plan_poses(plan)
    own_seed = (seed, zlib.crc32(plan.name.encode()))
    return Scene(
        name=plan.name,
        observations=None,
        features=made_up_features(locations_m, headings_deg, feature_count, own_seed),
        locations_m=locations_m,
        headings_deg=headings_deg,
        graph=graph,
        made_by=Provenance(
            SOURCE,
            seed=seed,
            versions={"clearway": __version__, "numpy": np.__version__},
            notes={"features": "made-up smooth functions of the pose; no pictures", **plan_notes(plan)},
        ),
        encoder=made_up_encoder(feature_count, seed),
        cell_size_m=plan.cell_size_m,
    )


def plan_notes(plan: FloorPlan) -> dict[str, object]:
    """What a scene's record keeps of a plan beside what its poses tell (JSON values), for `plan_of`."""
    parts = {
        "walls": plan.walls.tolist(),
        "doors": plan.doors.tolist(),
        "areas": [[area.use, list(area.low), list(area.high)] for area in plan.areas],
        "furniture": [[one.kind, list(one.low), list(one.high), one.front] for one in plan.furniture],
    }
    kept = {name: part for name, part in parts.items() if part}
    return {PLAN_NOTE: kept} if kept else {}


def plan_of(scene: Scene) -> FloorPlan:
    """The plan that a scene was made of.

    Raises:
        SceneError: its poses are no plan's, or its record of walls, doors, areas and furniture is damaged.
    """
    size_m, firsts = scene.cell_size_m, slice(None, None, HEADING_COUNT)
    cells = np.rint(scene.locations_m[firsts] / size_m).astype(np.int64)
    pairs, axes = neighbour_pairs(cells)
    # heading 90 looks along x, heading 0 along z
    ahead = scene.graph[np.minimum(HEADING_COUNT * pairs[:, 0] + 1 - axes, scene.state_count - 1), Action.MOVE_FORWARD]
    try:
        parts = scene.made_by.notes.get(PLAN_NOTE, {})
        assert isinstance(parts, dict)
        areas = tuple(Area(use, _cell(low), _cell(high)) for use, low, high in parts.get("areas", ()))
        pieces = parts.get("furniture", ())
        furniture = tuple(Furnishing(kind, _cell(low), _cell(high), front) for kind, low, high, front in pieces)
        walls, doors = (np.array(parts.get(name, []), np.int64).reshape(-1, 2) for name in ("walls", "doors"))
    except (AssertionError, TypeError, ValueError, OverflowError) as fault:
        raise SceneError(scene.name, "the record of its floor plan is damaged", REBUILD) from fault
    blocked = cells[pairs[ahead == BLOCKED]]
    plan = FloorPlan(scene.name, cells, blocked, size_m, walls=walls, doors=doors, areas=areas, furniture=furniture)
    locations_m, headings_deg, graph = plan_poses(plan)
    same = locations_m.shape == scene.locations_m.shape and np.allclose(locations_m, scene.locations_m)
    if not same or not np.array_equal(headings_deg, scene.headings_deg) or not np.array_equal(graph, scene.graph):
        raise SceneError(scene.name, "its poses are not those of a floor plan", REBUILD)
    return plan


def _cell(given: object) -> tuple[int, int]:
    """A cell, or an end of some, as a record holds it. Raises TypeError where it is none."""
    match given:
        case [int(first), int(second)] if bool not in (type(first), type(second)):
            return first, second
    raise TypeError("no cell")
