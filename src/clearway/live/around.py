"""What is around the body: whether it touches something where it stands, and how far the nearest obstacle is.

`RoomAround` are the obstacles of a room of ours, and MuJoCo's contacts with them. `ModelAround` is a MuJoCo model of
others, in which no body of ours has joints: contacts there are distances of nothing, by MuJoCo as well.

Coordinates: x is MuJoCo's x, z (across the floor) is MuJoCo's y.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import mujoco
import numpy as np

from clearway.rooms.navigation import Floor
from clearway.rooms.obstacles import AgentShape, CollisionRoom, bounding_boxes, copy_obstacle, obstacle_geoms

SURE_M = 1e-4  # measured distances are as exact as this
EDGES = -1  # among the obstacles of a model: the edges of its floor
EDGE_M = 0.1  # thickness of the walls around the floor


class Around(Protocol):
    """Where the body stands, and what is around it."""

    @property
    def place_m(self) -> np.ndarray:
        """(2,) x and z of the body."""

    def stand_at(self, place_m: np.ndarray) -> None:
        """Put the body to (2,) x and z."""

    @property
    def touches(self) -> bool:
        """It is in contact with something, or there is nothing to stand on."""

    def gap_m(self, most_m: float, among: np.ndarray | None = None) -> float:
        """Distance to the nearest obstacle, at most `most_m`; `among` as of `between`."""

    def between(self, one_m: np.ndarray, other_m: np.ndarray) -> np.ndarray | None:
        """Those obstacles that can be met between two places (2,), (K,) int; None: every place has to be tried."""


class Nearby:
    """Distances of one geom from others that stay where they are; boxes around them say which need to be measured.

    Args:
        model, data: with everything in its place.
        own: the geom that moves.
        others: (O,) geoms.
        radius_m: of the geom that moves, across the floor.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, own: int, others: np.ndarray, radius_m: float
    ) -> None:
        self._model, self._data, self._own, self._others, self._radius_m = model, data, own, others, radius_m
        centres_m, halves_m = bounding_boxes(model, data)
        self._centres_m, self._halves_m = centres_m[others, :2], halves_m[others, :2]

    def gap_m(self, place_m: np.ndarray, most_m: float, among: np.ndarray | None = None) -> float:
        """Distance to the nearest, at most `most_m`; negative where the geom reaches into one."""
        chosen = slice(None) if among is None else among
        beyond_m = np.maximum(np.abs(self._centres_m[chosen] - place_m) - self._halves_m[chosen], 0)
        least_m = np.hypot(beyond_m[:, 0], beyond_m[:, 1]) - self._radius_m
        others, gap_m = self._others[chosen], most_m
        for index in least_m.argsort().tolist():
            if least_m[index] >= gap_m:
                break
            gap_m = min(gap_m, mujoco.mj_geomDistance(self._model, self._data, self._own, others[index], gap_m, None))
        return gap_m

    def between(self, one_m: np.ndarray, other_m: np.ndarray) -> np.ndarray:
        """The places among the others of those whose boxes the geom can meet on the way, (K,) int."""
        reach_m = self._radius_m + SURE_M
        low_m, high_m = np.minimum(one_m, other_m) - reach_m, np.maximum(one_m, other_m) + reach_m
        met = (self._centres_m + self._halves_m >= low_m) & (self._centres_m - self._halves_m <= high_m)
        return np.flatnonzero(met.all(axis=1))


class RoomAround:
    """The obstacles of a room of ours, with walls at the edges of its floor.

    Args:
        room: its geoms of group 3 are the obstacles.
        agent: size of the body.
    """

    def __init__(self, room: CollisionRoom, agent: AgentShape | None = None) -> None:
        agent = agent or AgentShape()
        spec = mujoco.MjSpec()
        _add_edges(spec, room)
        for geom in obstacle_geoms(room.spec):
            copy_obstacle(spec, geom)
        half_m = agent.height_m / 2
        body = spec.worldbody.add_body(name="agent", pos=[0, 0, agent.lift_m + half_m])
        for axis in ([1, 0, 0], [0, 1, 0]):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        size_m = [agent.radius_m, half_m - agent.radius_m, 0]
        body.add_geom(name="agent", type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=size_m)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_fwdPosition(self._model, self._data)
        own = self._model.geom("agent").id
        others = np.array([index for index in range(self._model.ngeom) if index != own])
        self._nearby = Nearby(self._model, self._data, own, others, agent.radius_m)

    @property
    def place_m(self) -> np.ndarray:
        """See `Around`."""
        return np.array(self._data.qpos)

    def stand_at(self, place_m: np.ndarray) -> None:
        """See `Around`."""
        self._data.qpos[:] = place_m
        mujoco.mj_fwdPosition(self._model, self._data)

    @property
    def touches(self) -> bool:
        """MuJoCo reports a contact."""
        return self._data.ncon > 0

    def gap_m(self, most_m: float, among: np.ndarray | None = None) -> float:
        """See `Around`."""
        return self._nearby.gap_m(self.place_m, most_m, among)

    def between(self, one_m: np.ndarray, other_m: np.ndarray) -> np.ndarray:
        """See `Around`."""
        return self._nearby.between(one_m, other_m)


class ModelAround:
    """A MuJoCo model as it starts, on a rectangle of floor beyond which the body must not reach.

    Args:
        model: with the agent's body in it.
        data: of it, with everything in its place; may be shared, since nothing but the agent moves.
        own: the agent's geom.
        obstacles: (O,) geoms.
        floor: the rectangle.
        centre_m: height of the body's middle.
        radius_m: of the body.
        carries: whether there is something to stand on at (N, 2) points, (N,) bool; None: everywhere.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        own: int,
        obstacles: np.ndarray,
        floor: Floor,
        *,
        centre_m: float,
        radius_m: float,
        carries: Callable[[np.ndarray], np.ndarray] | None,
    ) -> None:
        self._data, self._own, self._carries = data, own, carries
        self._nearby = Nearby(model, data, own, obstacles, radius_m)
        self._least_m = np.array(floor.low_m) + radius_m
        self._most_m = np.array(floor.high_m) - radius_m
        self._centre_m, self._place_m = centre_m, np.array(floor.origin_m)

    @property
    def place_m(self) -> np.ndarray:
        """See `Around`."""
        return self._place_m.copy()

    def stand_at(self, place_m: np.ndarray) -> None:
        """See `Around`."""
        self._place_m = np.array(place_m, np.float64)

    @property
    def touches(self) -> bool:
        """Something is no distance away, or there is no floor."""
        if self.gap_m(SURE_M, self._met(self._place_m, self._place_m)) <= 0:
            return True
        return self._carries is not None and not self._carries(self._place_m[None])[0]

    def gap_m(self, most_m: float, among: np.ndarray | None = None) -> float:
        """See `Around`; the edges of the floor are obstacles too."""
        self._data.geom_xpos[self._own] = (*self._place_m, self._centre_m)
        if among is not None and not (among == EDGES).any():
            return self._nearby.gap_m(self._place_m, most_m, among)
        others = None if among is None else among[among != EDGES]
        return self._nearby.gap_m(self._place_m, min(most_m, self._edge_gap_m(self._place_m)), others)

    def between(self, one_m: np.ndarray, other_m: np.ndarray) -> np.ndarray | None:
        """See `Around`; where the floor may have holes, every sample has to be tried."""
        return None if self._carries is not None else self._met(one_m, other_m)

    def _met(self, one_m: np.ndarray, other_m: np.ndarray) -> np.ndarray:
        """The obstacles, EDGES among them where one of the places is at the edge of the floor."""
        met = self._nearby.between(one_m, other_m)
        inside = min(self._edge_gap_m(one_m), self._edge_gap_m(other_m)) > 0
        return met if inside else np.append(met, EDGES)

    def _edge_gap_m(self, place_m: np.ndarray) -> float:
        return float(np.minimum(place_m - self._least_m, self._most_m - place_m).min())


def _add_edges(spec: mujoco.MjSpec, room: CollisionRoom) -> None:
    """Walls around the floor, as the grid has them whether or not the room does."""
    width_m, depth_m, half_m = room.width_m, room.depth_m, EDGE_M / 2
    for place_m, size_m in (
        ((width_m / 2, -half_m), (width_m / 2 + EDGE_M, half_m)),
        ((width_m / 2, depth_m + half_m), (width_m / 2 + EDGE_M, half_m)),
        ((-half_m, depth_m / 2), (half_m, depth_m / 2)),
        ((width_m + half_m, depth_m / 2), (half_m, depth_m / 2)),
    ):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[*place_m, 1.5], size=[*size_m, 1.5])
