"""A floor plan as a furnished room, and the plan that the room's obstacles make."""

from __future__ import annotations

import zlib

import numpy as np

from clearway.rooms.daytime import draw_daytime
from clearway.rooms.detail import FULL, Detail
from clearway.rooms.furniture import openings
from clearway.rooms.light import bake
from clearway.rooms.materials import mixed_colours
from clearway.rooms.obstacles import AgentShape, Obstacles, collision_model
from clearway.rooms.plans.buildable import check_can_be_rendered
from clearway.rooms.plans.decoration import decorate
from clearway.rooms.plans.finish import finish_of
from clearway.rooms.plans.layout import Layout, lay_out
from clearway.rooms.plans.pieces import furnish
from clearway.rooms.plans.walls import DOOR_HEIGHT_M, GAP, LINING_M
from clearway.rooms.room import Room
from clearway.rooms.shell import add_faces, add_surfaces, add_walls
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.grid import neighbour_pairs

HEIGHT_M = 2.6
AGENT_RADIUS = 0.35  # cells: less than to a partition, more than half of what is open between two pieces
CLEARANCE = 0.02  # cells
LAYOUT_STREAM, MOOD_STREAM = 3, 4  # of random numbers, beside the room's own
DOOR_FRAMES = ("wood", "oak", "pine", "walnut", "cream", "cabinet")


def build_plan_room(
    plan: FloorPlan, seed: int = 0, *, looks: bool = True, loose: bool = False, detail: Detail = FULL
) -> tuple[Room, Layout]:
    """The room of a plan, and where its parts stand. Its obstacles leave the plan's cells and edges open, no others.

    Args:
        plan: the plan. Its name and the seed choose furniture, colours and textures.
        seed: 0 or more.
        looks: bake the light, so that `room.spec.compile()` is ready to render (seconds); False gives obstacles only.
        loose: every piece of furniture hangs on a body of its own, so that it can be moved (`pieces`).
        detail: how finely it is modelled and lit; `detail.SMALL` is for small pictures.

    Raises:
        SceneError: the plan's cells, their number or its extent are no room's, or the seed is negative.
    """
    check_can_be_rendered(plan, seed)
    layout_rng, mood_rng = (
        np.random.default_rng([seed, zlib.crc32(plan.name.encode()), stream]) for stream in (LAYOUT_STREAM, MOOD_STREAM)
    )
    layout = lay_out(plan, layout_rng)
    first_m = (0.5 + GAP) * plan.cell_size_m
    door_frame = "trim"
    room = Room(plan.name, layout.width_m, layout.depth_m, HEIGHT_M, (first_m, first_m), seed, looks, detail=detail)
    if layout.has_named_furniture:
        room.daytime, room.colours = draw_daytime(mood_rng), mixed_colours(mood_rng)
        door_frame = str(mood_rng.choice(DOOR_FRAMES))
    columns = layout.walls + layout.partitions
    add_walls(room, columns)
    if looks:
        finish = finish_of(room, layout)
        add_surfaces(room, finish, layout.partitions if layout.has_walls else columns)
        if layout.has_walls:
            add_faces(room, layout.faces, layout.cornices, layout.walls, finish)
    for doorway in layout.doorways:
        openings.doorway(room, doorway.at, doorway.width_m, doorway.depth_m, DOOR_HEIGHT_M, LINING_M, door_frame)
    tops_m = furnish(room, layout.pieces, first_m)
    decorate(room, layout, tops_m)
    cells, edges = open_plan(room, layout)
    assert _same(cells, plan.cells) and _same(edges, plan.cells[plan.edges]), f"the room of {plan.name} is another plan"
    if looks:
        bake(room, count_hidden=False, loose=loose)
    return room, layout


def agent_for(cell_size_m: float) -> AgentShape:
    """The body that fits through a plan's ways of one cell, and moves from cell to cell."""
    return AgentShape(radius_m=AGENT_RADIUS * cell_size_m, step_m=cell_size_m, clearance_m=CLEARANCE * cell_size_m)


def open_plan(room: Room, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """The cells of the layout's map where an agent stands free of every obstacle, and the free moves between them.

    Returns:
        cells: (C, 2) int64, x and z in the plan's numbers; by x, then z.
        edges: (E, 2, 2) int64, x and z of the two cells of each free move, the lower cell first.
    """
    agent = agent_for(layout.cell_size_m)
    obstacles = Obstacles(collision_model(room, agent), agent)
    places = np.argwhere(np.ones(layout.free.shape, bool))
    middles_m = layout.middles_m(places)
    free = obstacles.standing_gaps_m(middles_m) > agent.clearance_m
    cells, middles_m = places[free], middles_m[free]
    pairs, axes = neighbour_pairs(cells)
    clear = obstacles.moving_gaps_m(middles_m[pairs].mean(axis=1), axes) > agent.clearance_m
    numbered = cells + np.array(layout.first_cell)
    return numbered, numbered[pairs[clear]]


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two arrays hold the same rows, in whatever order."""
    return np.array_equal(np.unique(one, axis=0), np.unique(other, axis=0))
