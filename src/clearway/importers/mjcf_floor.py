"""The floor of a MuJoCo model: how far it reaches, and where the agent fits on it.

Coordinates: x is the model's x, z (across the floor) is the model's y, and heights are the model's z. The agent stands
where its capsule touches nothing and there is a floor below, and moves where nothing stands in between: the rule of
our own rooms (`rooms/navigation.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from clearway.errors import SceneError
from clearway.rooms.camera import CAMERA_HEIGHT_M
from clearway.rooms.navigation import Floor, NavigationGrid, grid_on_floor
from clearway.rooms.obstacles import AgentShape, Obstacles, body_geoms, bounding_boxes
from clearway.scenes.validate import MAX_COORDINATE_M

MAX_GRID_POINTS = 1 << 18  # places where the agent is tried
ABOVE_FLOOR_M, BELOW_FLOOR_M = 0.2, 0.1  # a floor is looked for between these, from the floor's height
EXTENT = "--extent X_MIN X_MAX Z_MIN Z_MAX"


@dataclass(frozen=True)
class FloorChoice:
    """What a model does not say of itself as a room.

    Attributes:
        floor_m: height of the floor.
        camera_m: height of the camera above the floor.
        spawn_m: a free place, x and z: the grid runs through it, and what cannot be reached from it is left out. None:
            the grid runs through the model's origin, and the largest connected part is kept.
        extent_m: smallest and largest x, smallest and largest z of the floor; None: what the model's finite geoms span.
        unfelt_too: geoms that collide with nothing block the way too.
    """

    floor_m: float = 0.0
    camera_m: float = CAMERA_HEIGHT_M
    spawn_m: tuple[float, float] | None = None
    extent_m: tuple[float, float, float, float] | None = None
    unfelt_too: bool = False


def floor_of(path: Path, model: mujoco.MjModel, data: mujoco.MjData, world: FloorChoice, step_m: float) -> Floor:
    """The rectangle that the agent may stand in.

    Raises:
        SceneError: it cannot be told, has no area, lies too far off, is too large, or the spawn point is not on it.
    """
    if world.extent_m is None:
        low_m, high_m = span_of(model, data)
        if not np.isfinite(low_m).all():
            raise SceneError(path, "it holds no geom of a finite size", f"Say how far its floor reaches: {EXTENT}")
        (x_low_m, z_low_m, _), (x_high_m, z_high_m, _) = low_m.tolist(), high_m.tolist()
    else:
        x_low_m, x_high_m, z_low_m, z_high_m = world.extent_m
    sides = f"its floor spans x from {x_low_m:g} to {x_high_m:g} m and z from {z_low_m:g} to {z_high_m:g} m"
    sane = all(low < high for low, high in ((x_low_m, x_high_m), (z_low_m, z_high_m)))
    if not sane or not all(abs(side) <= MAX_COORDINATE_M for side in (x_low_m, x_high_m, z_low_m, z_high_m)):
        problem = f"{sides}, expected lengths above 0 and numbers up to {MAX_COORDINATE_M:,.0f}"
        raise SceneError(path, problem, f"Say how far it reaches: {EXTENT}")
    x_m, z_m = origin_m = world.spawn_m or (0.0, 0.0)
    if world.spawn_m is not None and not (x_low_m <= x_m <= x_high_m and z_low_m <= z_m <= z_high_m):
        raise SceneError(
            path, f"{sides}, not to the spawn point ({x_m:g}, {z_m:g})", f"Give another --spawn or {EXTENT}"
        )
    places = (1 + (x_high_m - x_low_m) / step_m) * (1 + (z_high_m - z_low_m) / step_m)
    if places > MAX_GRID_POINTS:
        problem = f"{sides}: {places:,.0f} places to try, expected at most {MAX_GRID_POINTS:,}"
        raise SceneError(path, problem, f"Give a larger --step, or a part of it: {EXTENT}")
    return Floor((x_low_m, z_low_m), (x_high_m, z_high_m), origin_m)


def span_of(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """The smallest and the largest x, y and z of all finite geoms, (3,) each; Inf and -Inf where there are none.

    A plane counts as it is drawn: as large as its size says, endless where that is 0.
    """
    centres_m, halves_m = bounding_boxes(model, data)
    planes = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    drawn_m = model.geom_size * [1, 1, 0]
    rotations = data.geom_xmat.reshape(-1, 3, 3)
    centres_m[planes] = data.geom_xpos[planes]
    halves_m[planes] = np.einsum("gij,gj->gi", np.abs(rotations[planes]), drawn_m[planes])
    counted = ~planes | (drawn_m[:, :2] > 0).all(axis=1)
    counted[body_geoms(model)] = False
    low_m = (centres_m - halves_m)[counted].min(axis=0, initial=np.inf)
    return low_m, (centres_m + halves_m)[counted].max(axis=0, initial=-np.inf)


def find_cells(
    path: Path, model: mujoco.MjModel, data: mujoco.MjData, floor: Floor, world: FloorChoice, agent: AgentShape
) -> NavigationGrid:
    """The cells where the agent fits, and the moves between them.

    Raises:
        SceneError: it fits nowhere, or not where it should start.
    """
    grid = grid_on_floor(
        floor,
        Obstacles(model, agent, floor_m=world.floor_m, unfelt_too=world.unfelt_too),
        agent,
        from_origin=world.spawn_m is not None,
        carries=lambda points_m: on_floor(model, data, points_m, world.floor_m),
    )
    if grid is not None:
        return grid
    x_m, z_m = floor.origin_m
    where = "nowhere" if world.spawn_m is None else f"not at the spawn point ({x_m:g}, {z_m:g})"
    body = f"an agent {agent.height_m:g} m high with a radius of {agent.radius_m:g} m"
    remedy = "Check --floor-height, --spawn, --agent-radius and --step; a mesh blocks all of its convex hull"
    raise SceneError(path, f"{body} fits {where} on a floor at a height of {world.floor_m:g} m", remedy)


def on_floor(model: mujoco.MjModel, data: mujoco.MjData, points_m: np.ndarray, floor_m: float) -> np.ndarray:
    """Whether there is a floor at each of (N, 2) points, (N,) bool."""
    down, hit = np.array([0.0, 0.0, -1.0]), np.zeros(1, np.int32)
    depths_m = np.array(
        [
            mujoco.mj_ray(model, data, np.array([x_m, z_m, floor_m + ABOVE_FLOOR_M]), down, None, 1, -1, hit)
            for x_m, z_m in points_m
        ]
    )
    return (depths_m >= 0) & (depths_m <= ABOVE_FLOOR_M + BELOW_FLOOR_M)
