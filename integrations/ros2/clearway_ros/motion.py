"""One action of the agent as velocities over time: half a metre, or a quarter turn, and then nothing.

A move is *measured* where odometry tells the pose, else *timed*: the profile is run through, and what the wheels made
of it is not known. Axes are those of REP 103: x ahead, angles counter-clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from clearway.scenes.actions import Action


class Command(NamedTuple):
    """What the base is to do."""

    linear_m_s: float = 0.0
    angular_rad_s: float = 0.0


HALT = Command()


class Pose(NamedTuple):
    """Where odometry holds that the base is."""

    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(frozen=True)
class Drive:
    """How the base is driven.

    Raises:
        ValueError: a value is out of range.
    """

    step_m: float = 0.5
    """Length of a move; that of the agent's scene."""
    turn_deg: float = 90.0
    """Angle of a turn; that of the agent's scene."""
    linear_m_s: float = 0.2
    """Speed of a move."""
    angular_rad_s: float = 0.5
    """Speed of a turn."""
    linear_m_s2: float = 0.4
    """Acceleration of a move, and how it brakes."""
    angular_rad_s2: float = 1.0
    """Acceleration of a turn, and how it brakes."""
    tolerance_m: float = 0.01
    """A measured move ends so near to its end."""
    tolerance_deg: float = 1.0
    """A measured turn ends so near to its end."""
    patience: float = 3.0
    """A measured action is given up after so many times the seconds that it should take: something is in the way."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and math.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value!r}, expected a number above 0")
        if self.turn_deg >= 180:
            raise ValueError(f"turn_deg is {self.turn_deg:g}, expected less than 180")
        if self.patience < 1:
            raise ValueError(f"patience is {self.patience:g}, expected 1 or more")


def profile_seconds(distance: float, speed: float, acceleration: float) -> float:
    """Seconds of a trapezoid of velocity over a distance; of a triangle where the speed is never reached."""
    ramp = speed**2 / acceleration  # of both ramps together
    if distance < ramp:
        return 2 * math.sqrt(distance / acceleration)
    return 2 * speed / acceleration + (distance - ramp) / speed


def profile_speed(distance: float, speed: float, acceleration: float, elapsed_s: float) -> float:
    """Velocity of that trapezoid after so many seconds; 0 before and after."""
    left_s = profile_seconds(distance, speed, acceleration) - elapsed_s
    return max(0.0, min(speed, acceleration * elapsed_s, acceleration * left_s))


def braking_speed(left: float, speed: float, acceleration: float, elapsed_s: float, tick_s: float) -> float:
    """Velocity towards an end that is `left` away, by which it can still stop there; it is held for `tick_s`."""
    reach = acceleration * tick_s  # what one tick at the braking speed would overrun
    stoppable = math.sqrt(reach**2 / 4 + 2 * acceleration * max(left, 0.0)) - reach / 2
    return max(0.0, min(speed, acceleration * (elapsed_s + tick_s), stoppable))


class Motion:
    """An action that is under way.

    Args:
        action: of the agent.
        drive: how the base is driven.
        began_s: now.
        began_at: where odometry holds that the base is; None: nobody knows, and the action is timed.

    Attributes:
        given_up: a measured action has not come to its end, and will not.
    """

    def __init__(self, action: Action, drive: Drive, began_s: float, began_at: Pose | None = None) -> None:
        self._turns = action in (Action.TURN_LEFT, Action.TURN_RIGHT)
        self._sign = -1.0 if action in (Action.MOVE_BACKWARD, Action.TURN_RIGHT) else 1.0
        self._began_s, self._before_s, self._began_at = began_s, began_s, began_at
        self._patience = drive.patience
        if self._turns:
            self._distance, self._tolerance = math.radians(drive.turn_deg), math.radians(drive.tolerance_deg)
            self._speed, self._acceleration = drive.angular_rad_s, drive.angular_rad_s2
        else:
            self._distance, self._tolerance = drive.step_m, drive.tolerance_m
            self._speed, self._acceleration = drive.linear_m_s, drive.linear_m_s2
        self.given_up = False

    @property
    def measured(self) -> bool:
        """Whether odometry tells where it ends."""
        return self._began_at is not None

    @property
    def seconds(self) -> float:
        """That it should take."""
        return profile_seconds(self._distance, self._speed, self._acceleration)

    def command(self, now_s: float, at: Pose | None) -> Command | None:
        """What to do now; None once it has ended.

        Args:
            now_s: on the clock of `began_s`.
            at: where odometry holds that the base is now; a measured action is given up without it.
        """
        elapsed_s, tick_s = now_s - self._began_s, max(now_s - self._before_s, 0.0)
        self._before_s = now_s
        if self._began_at is None:
            over = elapsed_s >= self.seconds
            speed = profile_speed(self._distance, self._speed, self._acceleration, elapsed_s)
        else:
            left = None if at is None else self._distance - self._sign * self._gone(self._began_at, at)
            self.given_up = left is None or elapsed_s > self._patience * self.seconds
            over = left is None or self.given_up or left <= self._tolerance
            speed = 0.0
            if left is not None:
                speed = braking_speed(left, self._speed, self._acceleration, elapsed_s, tick_s)
        if over:
            return None
        return Command(0.0, self._sign * speed) if self._turns else Command(self._sign * speed, 0.0)

    def _gone(self, start: Pose, at: Pose) -> float:
        """Radians turned, counter-clockwise; or metres gone ahead, along the heading at the start."""
        if self._turns:
            turned = at.yaw_rad - start.yaw_rad
            return math.atan2(math.sin(turned), math.cos(turned))
        ahead = math.cos(start.yaw_rad), math.sin(start.yaw_rad)
        return (at.x_m - start.x_m) * ahead[0] + (at.y_m - start.y_m) * ahead[1]
