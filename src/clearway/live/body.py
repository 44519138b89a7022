"""The agent's body in a room: a standing capsule that MuJoCo moves until it touches something.

A move runs in small sub-steps. The first in which MuJoCo's collision detection reports a contact is halved until the
contact is found; there the move ends, the body a millimetre short of touching. A move has one contact at most.

Coordinates: x is MuJoCo's x, z (across the floor) is MuJoCo's y. Heading 0 looks along +z, 90 along +x.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from clearway.rooms.obstacles import AgentShape, CollisionRoom, copy_obstacle, obstacle_geoms

SAMPLES = 20
"""Sub-steps of a move, and the moments of a step at which the clearance is measured."""
HALVINGS = 12
STAND_OFF_M = 0.001  # so far does the body draw back from what it touched
REACH_M = 1.0  # clearances are measured up to here
SURE_M = 1e-4  # measured distances are as exact as this
EDGE_M = 0.1  # thickness of the walls around the floor


@dataclass(frozen=True)
class Motion:
    """What a step of the body did.

    Attributes:
        travelled_m: distance moved, negative backwards.
        contact: the move ended at an obstacle.
        gaps_m: (SAMPLES,) distance between the body and the nearest obstacle at equal moments, at most REACH_M; 0 from
            the contact on. Empty where nobody asked for them.
    """

    travelled_m: float
    contact: bool
    gaps_m: np.ndarray


class Body:
    """The body among the obstacles of a room.

    Args:
        room: its geoms of group 3 are the obstacles, and the floor's edges are walls.
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
        self._agent = self._model.geom("agent").id
        self._others = [index for index in range(self._model.ngeom) if index != self._agent]

    @property
    def place_m(self) -> np.ndarray:
        """(2,) x and z of the body."""
        return np.array(self._data.qpos)

    def stand_at(self, place_m: np.ndarray) -> None:
        """Put the body to (2,) x and z."""
        self._data.qpos[:] = place_m
        mujoco.mj_fwdPosition(self._model, self._data)

    @property
    def touches(self) -> bool:
        """MuJoCo reports a contact."""
        return self._data.ncon > 0

    def gap_m(self, most_m: float = REACH_M) -> float:
        """Distance to the nearest obstacle, at most `most_m`."""
        gap_m = most_m
        for other in self._others:
            gap_m = min(gap_m, mujoco.mj_geomDistance(self._model, self._data, self._agent, other, gap_m, None))
        return gap_m

    def wait(self, *, measured: bool = True) -> Motion:
        """A step in place: a turn changes nothing about a round body."""
        return Motion(0.0, False, np.full(SAMPLES, self.gap_m()) if measured else np.zeros(0))

    def move(self, distance_m: float, heading_deg: float, *, measured: bool = True) -> Motion:
        """Move along a heading, backwards where the distance is negative, until done or in contact.

        Args:
            distance_m: how far.
            heading_deg: in which direction.
            measured: note the gaps on the way, which takes most of the time.
        """
        start_m, way_m = self.place_m, distance_m * _along(heading_deg)
        gaps_m = np.zeros(SAMPLES if measured else 0)
        for sample, share in enumerate(np.arange(1, SAMPLES + 1) / SAMPLES):
            self.stand_at(start_m + share * way_m)
            if self.touches:
                share = self._draw_back(start_m, way_m, share - 1 / SAMPLES, share)
                return Motion(share * distance_m, True, gaps_m)
            if measured:
                gaps_m[sample] = self.gap_m()
        return Motion(distance_m, False, gaps_m)

    def free_steps(self, step_m: float, heading_deg: float, most: int) -> int:
        """How many steps along a heading, backwards where they are negative, would end without a contact.

        The body stays where it is. What `move` finds sample by sample is found here in fewer: where the nearest
        obstacle is a distance away, all samples within that distance are free.

        Args:
            step_m: length of a step.
            heading_deg: its direction.
            most: steps to look ahead.
        """
        start_m, part_m = self.place_m, step_m / SAMPLES
        sample, last = 0, most * SAMPLES
        while sample < last:
            sample = min(last, sample + max(1, int((self.gap_m() - SURE_M) / abs(part_m))))
            self.stand_at(start_m + sample * part_m * _along(heading_deg))
            if self.touches:
                break
        else:
            sample = last + 1
        self.stand_at(start_m)
        return (sample - 1) // SAMPLES

    def _draw_back(self, start_m: np.ndarray, way_m: np.ndarray, free: float, touching: float) -> float:
        """Stand just before the contact between two shares of a way; returns the share travelled."""
        for _ in range(HALVINGS):
            middle = (free + touching) / 2
            self.stand_at(start_m + middle * way_m)
            free, touching = (free, middle) if self.touches else (middle, touching)
        share = max(free - STAND_OFF_M / float(np.linalg.norm(way_m)), 0.0)
        self.stand_at(start_m + share * way_m)
        return share


def _along(heading_deg: float) -> np.ndarray:
    """(2,) x and z of the point a metre away along a heading."""
    heading = np.radians(heading_deg)
    return np.array([np.sin(heading), np.cos(heading)])


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
