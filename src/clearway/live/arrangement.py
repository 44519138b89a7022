"""Layouts of a room: furniture moved, a new obstacle on the way, and always a way left on the grid.

A layout is only taken if the target can still be reached from the start by free moves of the grid, so that a failure is
the agent's. Furniture that would run into something stays where it was.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from clearway.errors import SceneError
from clearway.rooms.groups import OBSTACLE_GROUP
from clearway.rooms.navigation import find_grid
from clearway.rooms.obstacles import AgentShape, CollisionRoom, copy_obstacle, obstacle_geoms
from clearway.rooms.pieces import is_loose, loose_obstacles, numbered, piece_count
from clearway.scenes.scene import Scene

NEW_RADIUS_M, NEW_HEIGHT_M = 0.15, 0.6
OUT_OF_SIGHT_M = (0.0, 0.0, -10.0)
TRIES = 5  # for the place of a piece
MOST_OVERLAP_M = 1e-4

Offset = tuple[float, float]


@dataclass(frozen=True)
class Arrangement:
    """How a room is arranged.

    Attributes:
        moved_m: x and z by which each piece of furniture is moved.
        new_m: x and z of the new obstacle, or None.
    """

    moved_m: tuple[Offset, ...]
    new_m: Offset | None = None

    @property
    def bodies_m(self) -> tuple[tuple[float, float, float], ...]:
        """Where the bodies of the visible room are for this layout (`camera.Shot.moved_m`)."""
        new_m = OUT_OF_SIGHT_M if self.new_m is None else (*self.new_m, 0.0)
        return (*((x_m, z_m, 0.0) for x_m, z_m in self.moved_m), new_m)

    def with_piece(self, piece: int, offset_m: Offset) -> Arrangement:
        """The same with one piece moved."""
        return Arrangement((*self.moved_m[:piece], offset_m, *self.moved_m[piece + 1 :]), self.new_m)


@dataclass(frozen=True)
class ArrangedRoom:
    """The obstacles of a room in a layout (`obstacles.CollisionRoom`)."""

    name: str
    width_m: float
    depth_m: float
    grid_origin_m: tuple[float, float]
    spec: mujoco.MjSpec


def as_built(room: CollisionRoom) -> Arrangement:
    """Nothing moved, nothing new."""
    return Arrangement(((0.0, 0.0),) * piece_count(room.spec))


def arranged(room: CollisionRoom, layout: Arrangement) -> ArrangedRoom:
    """The obstacles of a room in a layout."""
    spec = mujoco.MjSpec()
    pieces = iter(numbered(loose_obstacles(room.spec)))
    for geom in obstacle_geoms(room.spec):
        copy = copy_obstacle(spec, geom)
        if is_loose(geom):
            copy.pos[:2] += layout.moved_m[next(pieces)]
    if layout.new_m is not None:
        add_new_obstacle(spec.worldbody, (*layout.new_m, 0.0), group=OBSTACLE_GROUP)
    return ArrangedRoom(room.name, room.width_m, room.depth_m, room.grid_origin_m, spec)


def add_new_obstacle(body: mujoco.MjsBody, at_m: tuple[float, float, float], group: int) -> mujoco.MjsGeom:
    """A bin that stands on a point of the floor."""
    x_m, z_m, height_m = at_m
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[x_m, z_m, height_m + NEW_HEIGHT_M / 2],
        size=[NEW_RADIUS_M, NEW_HEIGHT_M / 2, 0],
        group=group,
    )


def furniture_moved(
    room: CollisionRoom,
    scene: Scene,
    start: int,
    target: int,
    most_m: float,
    rng: np.random.Generator,
    agent: AgentShape | None = None,
) -> Arrangement:
    """Each piece moved in a random direction by up to `most_m`, as far as it runs into nothing and a way remains.

    Args:
        room: as it was built.
        scene: the grid of it.
        start, target: states between which a way must remain.
        most_m: longest distance.
        rng: draws order, directions and distances.
        agent: its body.
    """
    layout = as_built(room)
    for piece in rng.permutation(len(layout.moved_m)).tolist():
        for _ in range(TRIES):
            angle, distance_m = rng.uniform(0, 2 * np.pi), rng.uniform(0, most_m)
            offset_m = (float(distance_m * np.sin(angle)), float(distance_m * np.cos(angle)))
            tried = layout.with_piece(piece, offset_m)
            if not _runs_into(room, layout, tried, piece) and way_remains(room, scene, tried, start, target, agent):
                layout = tried
                break
    return layout


def with_obstacle_on_path(
    room: CollisionRoom,
    scene: Scene,
    layout: Arrangement,
    start: int,
    target: int,
    rng: np.random.Generator,
    agent: AgentShape | None = None,
) -> Arrangement:
    """The layout with a bin in a cell of a shortest path, if there is one that leaves another way; else as it was."""
    path = shortest_path(scene, start, target)
    ends = {scene.cells[start], scene.cells[target]}
    cells = [state for state in path if scene.cells[state] not in ends]
    for state in rng.permutation(np.unique(cells)).tolist() if cells else []:
        x_m, z_m = scene.locations_m[state].tolist()
        tried = Arrangement(layout.moved_m, (x_m, z_m))
        if way_remains(room, scene, tried, start, target, agent):
            return tried
    return layout


def shortest_path(scene: Scene, start: int, target: int) -> list[int]:
    """States of a shortest path, both ends among them; of several the one that prefers the first action."""
    steps_to_go = scene.distances_to(np.array([target]))[0]
    assert steps_to_go[start] >= 0, "the target cannot be reached"
    path = [start]
    while path[-1] != target:
        onward = [state for state in scene.graph[path[-1]].tolist() if state >= 0]
        path.append(min(onward, key=lambda state: steps_to_go[state]))
    return path


def way_remains(
    room: CollisionRoom, scene: Scene, layout: Arrangement, start: int, target: int, agent: AgentShape | None = None
) -> bool:
    """Whether free moves of the grid still lead from the start to the target."""
    try:
        grid = find_grid(arranged(room, layout), agent or AgentShape())
    except SceneError:  # the agent fits nowhere
        return False
    ends_m = scene.locations_m[[start, target]]
    apart_m = np.linalg.norm(grid.locations_m[None] - ends_m[:, None], axis=2)
    return bool((apart_m.min(axis=1) < scene.cell_size_m / 10).all())


def _runs_into(room: CollisionRoom, before: Arrangement, after: Arrangement, piece: int) -> bool:
    """Whether a piece overlaps an obstacle or the floor's edge more than it did before."""
    overlap_m = [_overlaps_m(arranged(room, layout), piece) for layout in (before, after)]
    return bool((overlap_m[1] > overlap_m[0] + MOST_OVERLAP_M).any())


def _overlaps_m(room: ArrangedRoom, piece: int) -> np.ndarray:
    """How deep each obstacle of a piece reaches into each of the others' and over the edges of the floor, metres."""
    model = room.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    loose = [index for index, geom in enumerate(obstacle_geoms(room.spec)) if is_loose(geom)]
    numbers = numbered(loose_obstacles(room.spec))
    own = [index for index, number in zip(loose, numbers, strict=True) if number == piece]
    others = [index for index in range(model.ngeom) if index not in own]
    found_m = [-mujoco.mj_geomDistance(model, data, one, other, 0.01, None) for one in own for other in others]
    for one in own:
        half_m = np.abs(data.geom_xmat[one].reshape(3, 3)) @ model.geom_aabb[one, 3:]
        low_m, high_m = data.geom_xpos[one] - half_m, data.geom_xpos[one] + half_m
        found_m += [-low_m[0], -low_m[1], high_m[0] - room.width_m, high_m[1] - room.depth_m]
    return np.maximum(found_m, 0)
