"""`Walker`: the body with a heading, what it does with the agent's actions, and how near an obstacle it is."""

from __future__ import annotations

import numpy as np

from clearway.live.body import NO_GAPS, Body, Motion
from clearway.live.draws import Draws
from clearway.scenes.actions import MOVES, Action
from clearway.zones import Zone

Pose = tuple[float, float, float]
"""x and z in metres, heading in degrees."""

ARC_PARTS = 8  # chords that a step takes which moves and turns
SPARE = 1e-9  # of a tolerance, for rounding
SUCCESS_M = 0.25  # a target is reached within so much of its place, in rooms of smaller cells within half of one


class Walker:
    """A body on its way through a room.

    Args:
        body: in the room as it is arranged.
        pose: where it stands first.
        draws: the errors of its moves and turns.
        step_m: length of a move.
        turn_deg: angle of a turn.
        measured: its motions tell the gaps on the way (`Motion.gaps_m`).
    """

    def __init__(
        self, body: Body, pose: Pose, draws: Draws, *, step_m: float, turn_deg: float, measured: bool = True
    ) -> None:
        self.body, self.draws, self.measured = body, draws, measured
        self.step_m, self.turn_deg = step_m, turn_deg
        *place_m, self.heading_deg = pose
        body.stand_at(np.array(place_m))

    @property
    def pose(self) -> Pose:
        """Where it is and looks."""
        x_m, z_m = self.body.place_m.tolist()
        return x_m, z_m, self.heading_deg

    def act(self, action: Action) -> Motion:
        """Move or turn, more or less as far as it is meant to."""
        if action in MOVES:
            sign = 1 if action is Action.MOVE_FORWARD else -1
            distance_m = sign * (self.step_m + self.draws.distance_error_m())
            return self.body.move(distance_m, self.heading_deg, measured=self.measured)
        sign = 1 if action is Action.TURN_RIGHT else -1
        self._turn(sign * (self.turn_deg + self.draws.angle_error_deg()))
        return self.body.wait(measured=self.measured)

    def drive(self, speed: float, turn: float) -> Motion:
        """Move and turn at once, on an arc of a circle; a contact ends the move, and the turn goes on in place.

        Args:
            speed: share of a move, negative backwards.
            turn: share of a turn, to the right where it is positive.
        """
        distance_m = speed * (self.step_m + self.draws.distance_error_m())
        turned_deg = turn * (self.turn_deg + self.draws.angle_error_deg())
        parts = ARC_PARTS if distance_m and turned_deg else 1
        half = np.radians(turned_deg) / parts / 2
        chord_m = distance_m / parts * float(np.sinc(half / np.pi))  # of the arc of that length
        travelled_m, contact = 0.0, False
        for part in range(parts if distance_m else 0):
            heading_deg = self.heading_deg + (part + 0.5) * turned_deg / parts
            motion = self.body.move(chord_m, heading_deg, measured=False)
            travelled_m, contact = travelled_m + motion.travelled_m, motion.contact
            if contact:
                break
        self._turn(turned_deg)
        return Motion(travelled_m, contact, NO_GAPS)

    def _turn(self, angle_deg: float) -> None:
        self.heading_deg = (self.heading_deg + angle_deg) % 360

    def is_at(self, pose: Pose, within_m: float, within_deg: float) -> bool:
        """It stands and looks as a pose does, or nearly so."""
        return bool(near(self.pose, pose, within_m, within_deg))

    def zone(self) -> Zone:
        """Zone of where it is: as of the poses of the grid (`zones`), with contacts for blocked moves."""
        free = self.body.free_steps(self.step_m, self.heading_deg, 2)
        if free:
            free = min(free, self.body.free_steps(-self.step_m, self.heading_deg, 2))
        return (Zone.COLLISION, Zone.PRECOLLISION, Zone.FREE)[free]


def success_radius_m(cell_size_m: float) -> float:
    """How near its target's place a body has reached it, so that it does not where a neighbouring cell is."""
    return min(SUCCESS_M, cell_size_m / 2)


def near(poses: Pose | np.ndarray, other: Pose, within_m: float, within_deg: float) -> np.ndarray:
    """Whether poses (..., 3) are no farther from another, and turned no farther from it, than that, (...) bool."""
    x_m, z_m, heading_deg = np.moveaxis(np.asarray(poses, float), -1, 0)
    apart_m = np.hypot(x_m - other[0], z_m - other[1])
    off_deg = np.abs((heading_deg - other[2] + 180) % 360 - 180)
    return (apart_m <= within_m + SPARE) & (off_deg <= within_deg + SPARE)
