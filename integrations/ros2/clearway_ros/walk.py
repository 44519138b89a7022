"""`Walk`: when to look, when to move, when to stand still. It knows neither ROS nor clocks; it is told the time.

    standing -> (target) -> looking -> (decision) -> moving -> (end) -> looking ... -> arrived

The emergency stop is latched: whatever else happens, the base stands still until it is cleared.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

import numpy as np

from clearway.scenes.actions import Action
from clearway_ros.motion import HALT, Command, Drive, Motion, Pose

STANDING, LOOKING, MOVING, ARRIVED, STOPPED = "standing", "looking", "moving", "arrived", "stopped"

Decide = Callable[[np.ndarray], tuple[Action, bool | None] | None]
"""What to do, seeing a picture (height, width, 3) uint8; and whether this is the target, None where nobody can tell.
None altogether: the picture is of no use."""


@dataclass(frozen=True)
class Patience:
    """How long things are waited for, seconds.

    Raises:
        ValueError: a value is out of range.
    """

    picture_timeout_s: float = 1.0
    """The base stands still once the newest picture is older."""
    odometry_timeout_s: float = 0.5
    """Odometry that is older tells nothing."""
    settle_s: float = 0.3
    """Between the end of an action and the picture that the next one is decided by."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and math.isfinite(value) and value >= 0):
                raise ValueError(f"{name} is {value!r}, expected a number of seconds")


class Walk:
    """Walks to a target. Threads may share it: an emergency stop does not wait for a decision.

    Args:
        decide: asks the agent.
        send: gives a command to the base; called under a lock, so that nothing overtakes a stop.
        drive: how the base is driven.
        patience: how long things are waited for.
        stops_at_target: stand still where the agent holds that it has arrived; else walk on.

    Attributes:
        arrived: what the agent said at its last decision; None before it, and where it cannot tell.
        decisions: so many since the target was set.
        given_up: so many steps since then that did not come to their end.
    """

    def __init__(
        self,
        decide: Decide,
        send: Callable[[Command], object],
        drive: Drive,
        patience: Patience,
        *,
        stops_at_target: bool = True,
    ) -> None:
        self._decide, self._send, self._drive, self._patience = decide, send, drive, patience
        self._stops_at_target = stops_at_target
        self._lock = Lock()
        self._state, self._stopped, self._pressed = STANDING, False, False
        self._next: Action | None = None  # decided, and begun with the next tick: deciding took its time
        self._motion: Motion | None = None
        self._picture: tuple[float, np.ndarray] | None = None
        self._odometry: tuple[float, Pose] | None = None
        self._look_from_s = -math.inf
        self._episode, self._stops, self._at_rest = 0, 0, True
        self.arrived: bool | None = None
        self.decisions = self.given_up = 0

    @property
    def state(self) -> str:
        """What it is about."""
        return STOPPED if self._stopped else self._state

    def see(self, picture: np.ndarray, now_s: float) -> None:
        """A picture has come in."""
        self._picture = now_s, picture

    def feel(self, at: Pose, now_s: float) -> None:
        """Odometry has come in; what is no number tells nothing."""
        if all(map(math.isfinite, at)):
            self._odometry = now_s, at

    def begin(self, now_s: float) -> None:
        """There is a target: an episode begins with the next picture."""
        with self._lock:
            self._episode += 1
            self._state, self._next, self._motion = LOOKING, None, None
            self.arrived, self.decisions, self.given_up = None, 0, 0
            self._look_from_s = now_s
            self._send(HALT)

    def stop(self, pressed: bool = True) -> None:
        """The emergency stop: the base stands still at once, until `clear`. Letting go of it clears nothing."""
        with self._lock:
            self._pressed = pressed
            if pressed:
                self._stopped, self._next, self._motion = True, None, None
                self._stops += 1
                self._send(HALT)

    def clear(self, now_s: float) -> bool:
        """End the emergency stop; no: it is still pressed. The walk goes on with a new look, if there is a target."""
        with self._lock:
            if self._pressed:
                return False
            self._stopped = False
            if self._state == MOVING:
                self._state = LOOKING
            self._look_from_s = now_s
            return True

    def tick(self, now_s: float) -> None:
        """Do what is due, and send one command."""
        decided = self._due_decision(now_s)
        with self._lock:
            if decided is not None:
                self._follow(*decided, now_s)
            command = HALT if decided is not None else self._command(now_s)
            if not (self._at_rest and self.state in (STANDING, ARRIVED)):  # others may drive the base then
                self._send(command)
            self._at_rest = command == HALT

    def _due_decision(self, now_s: float) -> tuple[tuple[int, int], Action, bool | None] | None:
        """A decision by a picture that was taken after the last action, with the episode and the stops before it."""
        seen, asked = self._picture, (self._episode, self._stops)
        due = self._state == LOOKING and not self._stopped and self._sees(now_s)
        if not due or seen is None or seen[0] < self._look_from_s:
            return None
        told = self._decide(seen[1])
        return None if told is None else (asked, *told)

    def _follow(self, asked: tuple[int, int], action: Action, arrived: bool | None, now_s: float) -> None:
        """Take up what was decided, unless the target has changed or a stop was pressed meanwhile."""
        episode, stops = asked
        if episode != self._episode:
            return
        self.arrived, self.decisions = arrived, self.decisions + 1
        if arrived and self._stops_at_target:
            self._state = ARRIVED
        elif stops != self._stops:  # even if it is cleared already: there is to be a new look
            self._look_from_s = max(self._look_from_s, math.nextafter(now_s, math.inf))
        else:
            self._state, self._next = MOVING, action

    def _command(self, now_s: float) -> Command:
        if self._next is not None:
            self._next, self._motion = None, Motion(self._next, self._drive, now_s, self._at(now_s))
        if self._stopped or self._motion is None:
            return HALT
        command = self._motion.command(now_s, self._at(now_s)) if self._sees(now_s) else None
        if command is None:  # it has ended, or it is given up
            self.given_up += self._motion.given_up
            self._motion, self._state, self._look_from_s = None, LOOKING, now_s + self._patience.settle_s
        return command or HALT

    def _sees(self, now_s: float) -> bool:
        return self._picture is not None and now_s - self._picture[0] <= self._patience.picture_timeout_s

    def _at(self, now_s: float) -> Pose | None:
        if self._odometry is None or now_s - self._odometry[0] > self._patience.odometry_timeout_s:
            return None
        return self._odometry[1]
