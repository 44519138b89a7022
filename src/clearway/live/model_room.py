"""MuJoCo models of others as rooms to walk in: nothing is moved there, and the body stands on what carries it."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from clearway.importers.mjcf_world import SHOWN_GROUPS, ModelWorld, open_world, world_of
from clearway.live.around import ModelAround
from clearway.live.live_room import LiveRoom
from clearway.rooms.obstacles import Obstacles, body_geoms
from clearway.scenes.scene import Scene

LEVEL = 1 - 1e-9  # cosine of a level plane's tilt


def live_model(path: Path) -> LiveRoom:
    """The model in an MJCF or URDF file, with the floor and the body that `clearway scenes import mjcf` would take.

    Raises:
        SceneError: MuJoCo refuses the model, the world is too large, or the agent fits nowhere.
    """
    world = open_world(path)
    grid = world.grid
    return _live(
        Scene(
            path.stem,
            observations=None,
            features=None,
            locations_m=grid.state_locations_m,
            headings_deg=grid.state_headings_deg,
            graph=grid.graph,
            made_by=world.provenance(),
            cell_size_m=world.agent.step_m,
        ),
        world,
    )


def live_model_scene(scene: Scene) -> LiveRoom:
    """The model of an imported scene. Raises SceneError where it is missing or has changed."""
    return _live(scene, world_of(scene))


def _live(scene: Scene, world: ModelWorld) -> LiveRoom:
    camera_m = world.choice.floor_m + world.choice.camera_m
    return LiveRoom(scene, None, world.model, world.agent, camera_m=camera_m, groups=SHOWN_GROUPS, world=world)


def around_in(world: ModelWorld) -> ModelAround:
    """What is around a body in a model: the obstacles that its grid was found with."""
    agent, choice = world.agent, world.choice
    return ModelAround(
        world.model,
        world.data,
        body_geoms(world.model)[0],
        Obstacles(world.model, agent, floor_m=choice.floor_m, unfelt_too=choice.unfelt_too).candidates,
        world.floor,
        centre_m=choice.floor_m + agent.lift_m + agent.height_m / 2,
        radius_m=agent.radius_m,
        carries=None if _has_floor_everywhere(world) else world.carries,
    )


def _has_floor_everywhere(world: ModelWorld) -> bool:
    """An endless level plane at the height of the floor carries the body wherever it goes."""
    model, rotations = world.model, world.data.geom_xmat.reshape(-1, 3, 3)
    endless = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & (model.geom_size[:, :2] <= 0).all(axis=1)
    level = rotations[:, 2, 2] > LEVEL
    here = np.isclose(world.data.geom_xpos[:, 2], world.choice.floor_m)
    return bool((endless & level & here & (model.geom_rgba[:, 3] > 0)).any())
