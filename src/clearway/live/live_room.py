"""The room of a scene, built again: its obstacles for the body, and a model of it for the camera."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import SceneError
from clearway.generation.request import other_version
from clearway.live.conditions import REARRANGING, Perturbations
from clearway.live.draws import FURNITURE, OBSTACLE, Draws
from clearway.rooms.camera import CAMERA_HEIGHT_M, View, eye_view
from clearway.rooms.groups import CEILING_GROUP, SEEN_GROUP
from clearway.scenes import floor_plans, plan_scenes
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.targets import possible_targets

if TYPE_CHECKING:
    import mujoco

    from clearway.importers.mjcf_world import ModelWorld
    from clearway.live.arrangement import Arrangement
    from clearway.live.body import Body
    from clearway.rooms.detail import Detail
    from clearway.rooms.obstacles import AgentShape, CollisionRoom
    from clearway.scenes.floor_plans import FloorPlan

MODEL_SOURCE = "mjcf"
NEW_OBSTACLE_RGBA = (0.72, 0.36, 0.24, 1.0)


@dataclass(frozen=True, eq=False)
class LiveRoom:
    """A room to walk in.

    Attributes:
        scene: the grid of it that the agent knows, its locations in the room's coordinates.
        room: its obstacles; None of a MuJoCo model of others, in which nothing can be moved.
        model: what the camera sees; of a room of ours every piece of furniture, and last the new obstacle, is a mocap
            body, if it was built `loose`.
        agent: the body that walks in it; None: the paper's capsule.
        origin_m: x and z of the room's origin in the coordinates of the scene as it is kept.
        camera_m: height of the camera.
        groups: the geom groups that it sees.
        world: the MuJoCo model of others.
    """

    scene: Scene
    room: CollisionRoom | None
    model: mujoco.MjModel
    agent: AgentShape | None = None
    origin_m: tuple[float, float] = (0.0, 0.0)
    camera_m: float = CAMERA_HEIGHT_M
    groups: tuple[int, ...] = (SEEN_GROUP, CEILING_GROUP)
    world: ModelWorld | None = None

    def pose_of(self, state: int) -> tuple[float, float, float]:
        """x, z and heading of a state in the room."""
        x_m, z_m = self.scene.locations_m[state].tolist()
        return x_m, z_m, float(self.scene.headings_deg[state])

    def possible_targets(self, held_out: bool = False) -> np.ndarray:
        """States that may be drawn as targets, see `scenes.targets.possible_targets`."""
        kept = replace(self.scene, locations_m=self.scene.locations_m + np.array(self.origin_m))
        return possible_targets(kept, held_out)

    def as_built(self) -> Arrangement:
        """Nothing moved, nothing new."""
        from clearway.live.arrangement import Arrangement, as_built

        return Arrangement(()) if self.room is None else as_built(self.room)

    def bodies_m(self, layout: Arrangement) -> tuple[tuple[float, float, float], ...]:
        """Where the bodies of the model are in a layout (`camera.Shot.moved_m`)."""
        return () if self.room is None else layout.bodies_m

    def body(self, layout: Arrangement) -> Body:
        """A body of its own in the room in a layout."""
        from clearway.live.around import RoomAround
        from clearway.live.arrangement import arranged
        from clearway.live.body import Body
        from clearway.live.model_room import around_in

        if self.room is None:
            assert self.world is not None, "either a room or a model of others"
            return Body(around_in(self.world))
        return Body(RoomAround(arranged(self.room, layout), self.agent))

    def is_on_floor(self, x_m: float, z_m: float) -> bool:
        """Whether a point lies within the edges of the floor."""
        if self.room is None:
            assert self.world is not None, "either a room or a model of others"
            (x_low_m, z_low_m), (x_high_m, z_high_m) = self.world.floor.low_m, self.world.floor.high_m
            return x_low_m <= x_m <= x_high_m and z_low_m <= z_m <= z_high_m
        return 0 <= x_m <= self.room.width_m and 0 <= z_m <= self.room.depth_m

    def lens(self, height_px: int, width_px: int, *, fast: bool = False) -> View:
        """Pictures of this size through the agent's lens, `fast` as of `camera.View`."""
        return eye_view(height_px=height_px, width_px=width_px, groups=self.groups, fast=fast)

    def check_can_be_rearranged(self, perturbations: Perturbations) -> None:
        """Raise SceneError where perturbations move what cannot be moved here."""
        check_movable(self.scene.name, perturbations, fixed=self.room is None)
        wanted = [name for name in REARRANGING if getattr(perturbations, name)]
        if wanted and not self.model.nmocap:
            problem = f"the room was built with nothing loose in it, and {wanted[0]} is asked for"
            raise SceneError(self.scene.name, problem, "Build it loose, or leave the room to clearway")


def live_room(scene: Scene, *, small: bool = False, loose: bool = True) -> LiveRoom:
    """Build the room of a scene again, some seconds; or open its MuJoCo model.

    Args:
        scene: of a room of ours, a floor plan, a generated room or flat, or a MuJoCo model.
        small: modelled less finely, for small pictures (`rooms.detail.SMALL`); else as finely as the scene was.
        loose: its furniture can be moved, and a new obstacle put into it.

    Raises:
        SceneError: the scene is none of these, this version builds it differently, or its model is missing or changed.
    """
    check_is_room(scene)
    made = scene.made_by
    if made.source == MODEL_SOURCE:
        from clearway.live.model_room import live_model_scene

        return live_model_scene(scene)
    if made.source in floor_plans.SOURCES and made.seed is not None:
        return _live_plan(scene, plan_scenes.plan_of(scene), made.seed, small, loose)
    assert made.room is not None and made.seed is not None, "as check_is_room found"
    grid = room_scene(made.room, made.seed)
    if not np.array_equal(grid.graph, scene.graph) or not np.allclose(grid.locations_m, scene.locations_m):
        raise SceneError(
            scene.name,
            f"room {made.room} with seed {made.seed} has another grid in this version than in the file",
            "Build the scene again and train on it",
            "graph",
        )
    return _live_named(scene, made.room, made.seed, small, loose)


def check_is_room(scene: Scene) -> None:
    """Check by a scene's record, at once, that its room can be built again. Raises SceneError."""
    made = scene.made_by
    if made.source == floor_plans.GENERATED and (problem := other_version(made.notes)):
        raise SceneError(scene.name, problem, "Its looks may differ: generate it again, or use that clearway")
    is_plan = made.source in floor_plans.SOURCES and made.seed is not None
    is_named = made.source == "room" and made.room is not None and made.seed is not None
    if not (is_plan or is_named or made.source == MODEL_SOURCE):
        raise SceneError(
            scene.name,
            f"there is no room to walk in: the scene comes from {made.source}",
            "It cannot be seen anew: give what clearway scenes build, generate, import floor-plan or import mjcf made",
        )


def check_movable(name: str, perturbations: Perturbations, *, fixed: bool) -> None:
    """Raise SceneError where something is to be moved in a room of that name, and nothing can be: it is fixed."""
    wanted = [part for part in REARRANGING if getattr(perturbations, part)]
    if fixed and wanted:
        problem = f"nothing can be moved in a MuJoCo model, and {wanted[0]} is asked for"
        raise SceneError(name, problem, f"Leave out {' and '.join(REARRANGING)}")


def live_room_named(name: str, seed: int = 0, *, small: bool = False, loose: bool = True) -> LiveRoom:
    """One of our own rooms, without a scene file; some seconds. `small` and `loose` as of `live_room`.

    Raises:
        SceneError: there is no such room, or the seed is negative.
    """
    return _live_named(room_scene(name, seed), name, seed, small, loose)


def _live_named(scene: Scene, name: str, seed: int, small: bool, loose: bool) -> LiveRoom:
    from clearway.rooms import build_room

    room = build_room(name, seed, loose=loose, detail=_detail(small))
    return LiveRoom(scene, room, camera_model(room.spec) if loose else room.spec.compile())


def _detail(small: bool) -> Detail:
    """How finely a room is modelled."""
    from clearway.rooms.detail import FULL, SMALL

    return SMALL if small else FULL


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


def _live_plan(scene: Scene, plan: FloorPlan, seed: int, small: bool, loose: bool) -> LiveRoom:
    """The room of a floor plan, and the scene moved to where the room's corner is the origin."""
    from clearway.rooms.build import check_mujoco

    if not np.array_equal(plan_scenes.plan_poses(plan)[2], scene.graph):
        raise SceneError(scene.name, "its moves are not those of its floor plan", plan_scenes.REBUILD, "graph")
    check_mujoco()
    from clearway.rooms.detail import SMALL, recorded_detail
    from clearway.rooms.plans.plan_room import agent_for, build_plan_room

    detail = SMALL if small else recorded_detail(scene.name, scene.made_by.notes)
    room, layout = build_plan_room(plan, seed, loose=loose, detail=detail)
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
    model = camera_model(room.spec) if loose else room.spec.compile()
    return LiveRoom(moved, room, model, agent_for(plan.cell_size_m), layout.origin_m)


def layout_of_episode(live: LiveRoom, start: int, target: int, draws: Draws) -> Arrangement:
    """The layout of the room in an episode between two states, as its perturbations ask for it."""
    from clearway.live.arrangement import furniture_moved, with_obstacle_on_path

    layout, wanted = live.as_built(), draws.perturbations
    if live.room is None:
        return layout
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

    body = spec.worldbody.add_body(name="new obstacle", mocap=True, pos=OUT_OF_SIGHT_M)
    geom = add_new_obstacle(body, (0.0, 0.0, 0.0), SEEN_GROUP)
    geom.rgba[:] = NEW_OBSTACLE_RGBA
    geom.contype = geom.conaffinity = 0
    return spec.compile()
