"""How far the agent's body is from the obstacles of a world: measured by MuJoCo, standing and on a move.

Coordinates: x is MuJoCo's x, z (across the floor) is MuJoCo's y, and the height is MuJoCo's z. The obstacles are the
geoms that can collide, meshes as their convex hulls; the floor, a level plane, blocks nothing. Of our own rooms only
the collision geoms count: the boxes, cylinders, capsules, spheres and ellipsoids of group 3, direct children of the
world body, placed by pos and quat.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from clearway.rooms.groups import OBSTACLE_GROUP

OBSTACLE_SHAPES = (
    mujoco.mjtGeom.mjGEOM_BOX,
    mujoco.mjtGeom.mjGEOM_CYLINDER,
    mujoco.mjtGeom.mjGEOM_CAPSULE,
    mujoco.mjtGeom.mjGEOM_SPHERE,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID,
)
MARGIN_REACH_M = 0.1  # distances to obstacles are measured up to this far beyond the threshold
BODY_PREFIX = "clearway agent/"
STANDING, MOVING_ALONG_X, MOVING_ALONG_Z = "standing", "moving along x", "moving along z"
UNSEEN_GROUP = 5
PAIRS_AT_ONCE = 1 << 22  # of points and obstacles that are held against each other together


class CollisionRoom(Protocol):
    """What the navigation grid needs to know of a room."""

    @property
    def name(self) -> str:
        """Name for error messages."""

    @property
    def width_m(self) -> float:
        """Extent of the floor along x, from 0."""

    @property
    def depth_m(self) -> float:
        """Extent of the floor along z (MuJoCo's y), from 0."""

    @property
    def spec(self) -> mujoco.MjSpec:
        """The room; its geoms of group 3 are the obstacles."""

    @property
    def grid_origin_m(self) -> tuple[float, float]:
        """A point of the grid, (x, z)."""


@dataclass(frozen=True)
class AgentShape:
    """The agent's body, a standing capsule, and how it moves.

    Attributes:
        radius_m: radius of the capsule.
        height_m: length of the capsule with its caps.
        step_m: length of a move, and the pitch of the grid.
        clearance_m: a place or a move is free where every obstacle is farther from the body than this
            (an exact touch would be decided by rounding).
        lift_m: height of the capsule's foot above the floor.
    """

    radius_m: float = 0.2
    height_m: float = 1.5
    step_m: float = 0.5
    clearance_m: float = 0.01
    lift_m: float = 0.03


def add_body(spec: mujoco.MjSpec, agent: AgentShape) -> None:
    """Add the agent to a world, unseen: the standing capsule, and the boxes it sweeps on a move along x and along z."""
    half_m, radius_m, step_m = agent.height_m / 2, agent.radius_m, agent.step_m
    body = mujoco.MjSpec()  # of its own, so that the world's default settings do not change it
    for name, kind, size_m in (
        (STANDING, mujoco.mjtGeom.mjGEOM_CAPSULE, (radius_m, half_m - radius_m, 0.0)),
        (MOVING_ALONG_X, mujoco.mjtGeom.mjGEOM_BOX, (step_m / 2, radius_m, half_m)),
        (MOVING_ALONG_Z, mujoco.mjtGeom.mjGEOM_BOX, (radius_m, step_m / 2, half_m)),
    ):
        geom = body.worldbody.add_geom(name=name, type=kind, size=size_m, group=UNSEEN_GROUP)
        geom.rgba[:] = 0  # rays pass through what is transparent
        geom.contype = geom.conaffinity = 0
    spec.attach(body, prefix=BODY_PREFIX, frame=spec.worldbody.add_frame())


def body_geoms(model: mujoco.MjModel) -> list[int]:
    """The agent's geoms in a model: standing, moving along x, moving along z."""
    return [model.geom(f"{BODY_PREFIX}{name}").id for name in (STANDING, MOVING_ALONG_X, MOVING_ALONG_Z)]


def collision_model(room: CollisionRoom, agent: AgentShape) -> mujoco.MjModel:
    """The obstacles of one of our own rooms and the agent's body, without meshes: compiles in milliseconds."""
    spec = mujoco.MjSpec()
    for geom in obstacle_geoms(room.spec):
        copy_obstacle(spec, geom)
    add_body(spec, agent)
    return spec.compile()


class Obstacles:
    """A world's obstacles and the agent's body, to measure the gaps between them with MuJoCo.

    The agent's geoms are put to their places by writing their world positions; nothing else in the model moves.

    Attributes:
        candidates: (O,) the geoms that can be in the way.
    """

    def __init__(
        self, model: mujoco.MjModel, agent: AgentShape, *, floor_m: float = 0.0, unfelt_too: bool = False
    ) -> None:
        """Place everything as the model starts.

        Args:
            model: a world with the agent's body in it, see `add_body`.
            agent: the body's sizes.
            floor_m: height of the floor.
            unfelt_too: geoms that collide with nothing are obstacles too.
        """
        self._model = model
        self._data = mujoco.MjData(model)
        mujoco.mj_kinematics(self._model, self._data)
        body = body_geoms(model)
        self._standing, self._moving = body[0], np.array(body[1:])
        self._centre_height_m = floor_m + agent.lift_m + agent.height_m / 2
        self._reach_m = agent.clearance_m + MARGIN_REACH_M
        lowest_m = floor_m + agent.lift_m - agent.clearance_m
        highest_m = floor_m + agent.lift_m + agent.height_m + agent.clearance_m
        self._centres_m, self._halves_m = bounding_boxes(self._model, self._data)
        tops_m, bottoms_m = (self._centres_m + sign * self._halves_m for sign in (1, -1))
        in_reach = (tops_m[:, 2] > lowest_m) & (bottoms_m[:, 2] < highest_m)
        felt = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        in_reach &= felt | unfelt_too
        in_reach[body] = False
        self.candidates = np.nonzero(in_reach)[0]

    def standing_gaps_m(self, points_m: np.ndarray) -> np.ndarray:
        """Gap between the agent at (N, 2) points and the nearest obstacle, (N,); negative: overlap."""
        return self._gaps_m(points_m, np.full(len(points_m), self._standing))

    def moving_gaps_m(self, middles_m: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Gap between the nearest obstacle and the space swept by a move, (N,); negative: overlap.

        Args:
            middles_m: (N, 2) the middles of the moves, x and z.
            axes: (N,) 0 for a move along x, 1 for one along z.
        """
        return self._gaps_m(middles_m, self._moving[axes])

    def _gaps_m(self, points_m: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        gaps_m = np.full(len(points_m), self._reach_m)
        at_once = max(1, PAIRS_AT_ONCE // max(1, len(self.candidates)))
        for first in range(0, len(points_m), at_once):
            part = slice(first, first + at_once)
            near = self._near(points_m[part], bodies[part])
            for index, (point_m, body) in enumerate(zip(points_m[part], bodies[part], strict=True)):
                self._data.geom_xpos[body] = (*point_m, self._centre_height_m)
                for obstacle in self.candidates[near[index]]:
                    gap_m = mujoco.mj_geomDistance(self._model, self._data, body, obstacle, self._reach_m, None)
                    gaps_m[first + index] = min(gaps_m[first + index], gap_m)
        return gaps_m

    def _near(self, points_m: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Which obstacles may be within reach of each body at its point, (N, obstacles) bool."""
        apart_m = np.abs(points_m[:, None] - self._centres_m[None, self.candidates, :2])
        sum_m = self._halves_m[bodies, None, :2] + self._halves_m[None, self.candidates, :2]
        return np.all(apart_m < sum_m + self._reach_m, axis=2)


def obstacle_geoms(spec: mujoco.MjSpec) -> list[mujoco.MjsGeom]:
    """The collision geoms of a room, in the spec's order."""
    return [g for g in spec.geoms if g.group == OBSTACLE_GROUP and g.type != mujoco.mjtGeom.mjGEOM_PLANE]


def copy_obstacle(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> mujoco.MjsGeom:
    """Copy a collision geom into another model, which has no meshes and compiles in milliseconds."""
    placed_plainly = (
        geom.parent.name == "world"
        and geom.frame is None
        and geom.alt.type == mujoco.mjtOrientation.mjORIENTATION_QUAT
        and np.isnan(geom.fromto[0])
    )
    assert placed_plainly, f"collision geom '{geom.name}' must hang on the world body by pos and quat"
    assert geom.type in OBSTACLE_SHAPES, f"collision geom '{geom.name}' must be one of {OBSTACLE_SHAPES}"
    copy = spec.worldbody.add_geom(name=geom.name, type=geom.type, pos=geom.pos, quat=geom.quat, group=OBSTACLE_GROUP)
    copy.size[:] = geom.size
    return copy


def bounding_boxes(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Centres and half sizes, both (geoms, 3) metres, of the boxes that hold each geom; a plane is half of space."""
    rotations = data.geom_xmat.reshape(-1, 3, 3)
    centres_m = data.geom_xpos + np.einsum("gij,gj->gi", rotations, model.geom_aabb[:, :3])
    return centres_m, np.einsum("gij,gj->gi", np.abs(rotations), model.geom_aabb[:, 3:])
