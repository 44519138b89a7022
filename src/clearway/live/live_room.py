"""The room of a scene, built again: its obstacles for the body, and a model of it for the camera."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import SceneError
from clearway.live.draws import FURNITURE, OBSTACLE, Draws
from clearway.scenes import floor_plans
from clearway.scenes.scene import Provenance, Scene

if TYPE_CHECKING:
    import mujoco

    from clearway.live.arrangement import Arrangement
    from clearway.rooms.obstacles import AgentShape, CollisionRoom
    from clearway.scenes.floor_plans import FloorPlan

NEW_OBSTACLE_RGBA = (0.72, 0.36, 0.24, 1.0)


@dataclass(frozen=True, eq=False)
class LiveRoom:
    """A room to walk in.

    Attributes:
        scene: the grid of it that the agent knows, its locations in the room's coordinates.
        room: its obstacles.
        model: what the camera sees; every piece of furniture, and last the new obstacle, is a mocap body.
        agent: the body that walks in it; None: the paper's capsule.
        origin_m: x and z of the room's origin in the coordinates of the scene as it is kept.
    """

    scene: Scene
    room: CollisionRoom
    model: mujoco.MjModel
    agent: AgentShape | None = None
    origin_m: tuple[float, float] = (0.0, 0.0)

    def pose_of(self, state: int) -> tuple[float, float, float]:
        """x, z and heading of a state in the room."""
        x_m, z_m = self.scene.locations_m[state].tolist()
        return x_m, z_m, float(self.scene.headings_deg[state])


def live_room(scene: Scene) -> LiveRoom:
    """Build the room of a scene again, some seconds.

    Raises:
        SceneError: the scene is no room of ours, floor plan or generated one, or this version builds it differently.
    """
    made = scene.made_by
    if made.source in floor_plans.SOURCES and made.seed is not None:
        return _live_plan(scene, floor_plans.plan_of(scene), made.seed)
    if made.source != "room" or made.room is None or made.seed is None:
        raise SceneError(
            scene.name,
            f"there is no room to walk in: the scene comes from {made.source}",
            "Walk live in a scene that clearway scenes build, generate or import floor-plan made",
        )
    grid = room_scene(made.room, made.seed)
    if not np.array_equal(grid.graph, scene.graph) or not np.allclose(grid.locations_m, scene.locations_m):
        raise SceneError(
            scene.name,
            f"room {made.room} with seed {made.seed} has another grid in this version than in the file",
            "Build the scene again and train on it",
            "graph",
        )
    return _live_named(scene, made.room, made.seed)


def live_room_named(name: str, seed: int = 0) -> LiveRoom:
    """One of our own rooms, without a scene file; some seconds.

    Raises:
        SceneError: there is no such room, or the seed is negative.
    """
    return _live_named(room_scene(name, seed), name, seed)


def _live_named(scene: Scene, name: str, seed: int) -> LiveRoom:
    from clearway.rooms import build_room

    room = build_room(name, seed, loose=True)
    return LiveRoom(scene, room, camera_model(room.spec))


def room_scene(name: str, seed: int = 0) -> Scene:
    """The grid of one of our own rooms as a scene, without pictures and features, in milliseconds.

    Raises:
        SceneError: there is no such room, or the seed is negative.
    """
    from clearway.rooms.build import check_mujoco, scene_name

    check_mujoco()
    from clearway.rooms import build_room
    from clearway.rooms.navigation import find_grid

    grid = find_grid(build_room(name, seed, looks=False))
    made_by = Provenance("room", room=name, seed=seed)
    places_m, headings_deg = grid.state_locations_m, grid.state_headings_deg
    return Scene(scene_name(name, seed), None, None, places_m, headings_deg, grid.graph, made_by)


def _live_plan(scene: Scene, plan: FloorPlan, seed: int) -> LiveRoom:
    """The room of a floor plan, and the scene moved to where the room's corner is the origin."""
    from clearway.rooms.build import check_mujoco

    if not np.array_equal(floor_plans.plan_poses(plan)[2], scene.graph):
        raise SceneError(scene.name, "its moves are not those of its floor plan", floor_plans.REBUILD, "graph")
    check_mujoco()
    from clearway.rooms.detail import recorded_detail
    from clearway.rooms.plans.plan_room import agent_for, build_plan_room

    detail = recorded_detail(scene.name, scene.made_by.notes)
    room, layout = build_plan_room(plan, seed, loose=True, detail=detail)
    locations_m = scene.locations_m - np.array(layout.origin_m)
    x_m, z_m = layout.origin_m
    view = scene.top_view and replace(
        scene.top_view,
        x_min_m=scene.top_view.x_min_m - x_m,
        x_max_m=scene.top_view.x_max_m - x_m,
        z_min_m=scene.top_view.z_min_m - z_m,
        z_max_m=scene.top_view.z_max_m - z_m,
    )
    moved = replace(scene, locations_m=locations_m, top_view=view)
    return LiveRoom(moved, room, camera_model(room.spec), agent_for(plan.cell_size_m), layout.origin_m)


def layout_of_episode(live: LiveRoom, start: int, target: int, draws: Draws) -> Arrangement:
    """The layout of the room in an episode between two states, as its perturbations ask for it."""
    from clearway.live.arrangement import as_built, furniture_moved, with_obstacle_on_path

    layout, wanted = as_built(live.room), draws.perturbations
    if wanted.move_furniture:
        rng = draws.generator(FURNITURE)
        layout = furniture_moved(live.room, live.scene, start, target, wanted.move_furniture, rng, live.agent)
    if wanted.new_obstacle:
        rng = draws.generator(OBSTACLE)
        layout = with_obstacle_on_path(live.room, live.scene, layout, start, target, rng, live.agent)
    return layout


def camera_model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled room with the new obstacle on a body of its own, out of sight."""
    from clearway.live.arrangement import OUT_OF_SIGHT_M, add_new_obstacle
    from clearway.rooms.groups import SEEN_GROUP

    body = spec.worldbody.add_body(name="new obstacle", mocap=True, pos=OUT_OF_SIGHT_M)
    geom = add_new_obstacle(body, (0.0, 0.0, 0.0), SEEN_GROUP)
    geom.rgba[:] = NEW_OBSTACLE_RGBA
    geom.contype = geom.conaffinity = 0
    return spec.compile()
