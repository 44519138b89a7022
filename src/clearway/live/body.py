"""The agent's body in a room: a standing capsule that MuJoCo moves until it touches something.

A move runs in small sub-steps. The first in which MuJoCo's collision detection reports a contact is halved until the
contact is found; there the move ends, the body a millimetre short of touching. A move has one contact at most.

Coordinates: x is MuJoCo's x, z (across the floor) is MuJoCo's y. Heading 0 looks along +z, 90 along +x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.live.around import SURE_M, Around

SAMPLES = 20
"""Sub-steps of a move, and the moments of a step at which the clearance is measured."""
HALVINGS = 12
STAND_OFF_M = 0.001  # so far does the body draw back from what it touched
REACH_M = 1.0  # clearances are measured up to here
CLOSE = 4
NO_GAPS = np.zeros(0)


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
    """The body, and what it does among obstacles.

    Args:
        around: what is around it.
    """

    def __init__(self, around: Around) -> None:
        self._around = around

    @property
    def place_m(self) -> np.ndarray:
        """(2,) x and z of the body."""
        return self._around.place_m

    def stand_at(self, place_m: np.ndarray) -> None:
        """Put the body to (2,) x and z."""
        self._around.stand_at(place_m)

    @property
    def touches(self) -> bool:
        """It is in contact with something."""
        return self._around.touches

    def gap_m(self, most_m: float = REACH_M) -> float:
        """Distance to the nearest obstacle, at most `most_m`."""
        return self._around.gap_m(most_m)

    def wait(self, *, measured: bool = True) -> Motion:
        """A step in place: a turn changes nothing about a round body."""
        return Motion(0.0, False, np.full(SAMPLES, self.gap_m()) if measured else NO_GAPS)

    def move(self, distance_m: float, heading_deg: float, *, measured: bool = True) -> Motion:
        """Move along a heading, backwards where the distance is negative, until done or in contact.

        Args:
            distance_m: how far.
            heading_deg: in which direction.
            measured: note the gaps on the way, which takes most of the time.
        """
        start_m, way_m = self.place_m, distance_m * _along(heading_deg)
        gaps_m = np.zeros(SAMPLES) if measured else NO_GAPS
        touching = self._first_contact(start_m, way_m, SAMPLES, gaps_m)
        if touching is None:
            return Motion(distance_m, False, gaps_m)
        share = self._draw_back(start_m, way_m, (touching - 1) / SAMPLES, touching / SAMPLES)
        return Motion(share * distance_m, True, gaps_m)

    def free_steps(self, step_m: float, heading_deg: float, most: int) -> int:
        """How many steps along a heading, backwards where they are negative, would end without a contact.

        The body stays where it is.

        Args:
            step_m: length of a step.
            heading_deg: its direction.
            most: steps to look ahead.
        """
        start_m = self.place_m
        touching = self._first_contact(start_m, most * step_m * _along(heading_deg), most * SAMPLES)
        self.stand_at(start_m)
        return most if touching is None else (touching - 1) // SAMPLES

    def _first_contact(
        self, start_m: np.ndarray, way_m: np.ndarray, samples: int, gaps_m: np.ndarray = NO_GAPS
    ) -> int | None:
        """The first of the samples 1, 2, ... of a way in which the body touches something; None: it is at the end.

        Not every sample is looked at: where the nearest obstacle is a distance away, all within that distance are free.

        Args:
            start_m: where the body stands, (2,).
            way_m: (2,) from there to the last sample.
            samples: how many there are.
            gaps_m: (samples,) where the gap of every free sample is noted; empty: nowhere, and samples are leapt over.
        """
        part_m = float(np.linalg.norm(way_m)) / samples
        met = None if len(gaps_m) else self._around.between(start_m, start_m + way_m)
        leaps = met is not None and part_m > 0
        sample = close = 0  # close to an obstacle, some samples are tried without measuring anew
        while sample < samples:
            ahead, close = 1, close - 1
            if leaps and close < 0:
                gap_m = self._around.gap_m((samples - sample) * part_m + 2 * SURE_M, met)
                ahead = min(samples - sample, max(1, int((gap_m - SURE_M) / part_m)))
                close = CLOSE if ahead == 1 else 0
            sample += ahead
            self.stand_at(start_m + sample / samples * way_m)
            if self.touches:
                return sample
            if len(gaps_m):
                gaps_m[sample - 1] = self.gap_m()
        return None

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
