"""Where the takes of a pose are: near it, in layouts of the furniture, each under a perturbation of its own."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from clearway.live.arrangement import Arrangement
from clearway.live.body import Body
from clearway.live.conditions import REARRANGING, Perturbations
from clearway.live.draws import Draws
from clearway.live.live_room import LiveRoom, layout_of_episode
from clearway.live.walker import Pose
from clearway.rooms.camera import Shot, first_person_shot
from clearway.views.settings import ViewSettings

LEAST_LAYOUTS = 4  # of a room in which furniture is moved: each takes some tenths of a second to find
POSES, LAYOUTS, STATES = range(3)  # streams of random numbers: of poses drawn, of layouts, of a grid's states
TAKE_TRIES = 20  # at a free place for a take


@dataclass(frozen=True)
class PlacedTake:
    """One take of a pose.

    Attributes:
        draws: its chances, for its light and noise.
        pose: x, z and heading of the body, in the room's coordinates.
        layout: where the furniture stands, a number of `TakePlaces.layouts`.
        height_m, pitch_deg: of the camera.
        shot: the camera's place.
    """

    draws: Draws
    pose: Pose
    layout: int
    height_m: float
    pitch_deg: float
    shot: Shot


class TakePlaces:
    """Where in a room takes may be.

    Args:
        live: the room.
        cells_m: (C, 2), the middles of the cells in whose squares they may be.
        settings: how strongly, and how often, poses are perturbed.

    Attributes:
        layouts: the room as it was built, then its other layouts.
        bodies: one in each layout.

    Raises:
        SceneError: furniture is to be moved, and nothing can be.
    """

    def __init__(self, live: LiveRoom, cells_m: np.ndarray, settings: ViewSettings) -> None:
        live.check_can_be_rearranged(settings.perturbations)
        self._live, self._cells_m, self._settings = live, cells_m, settings
        self._half_m = live.scene.cell_size_m / 2
        self.layouts = layouts(live, settings)
        self.bodies = [live.body(layout) for layout in self.layouts]

    def placed(self, pose: Pose, number: int, take: int, seed: int) -> PlacedTake:
        """A take of the room's pose of this number. Furniture that stands in its way is as it was built."""
        live, others = self._live, len(self.layouts) - 1
        draws = Draws(seed, self._settings.perturbations)
        wanted = 1 + (number * self._settings.takes + take) % others if others else 0
        near = self._near(self.bodies[wanted], pose, draws)
        layout = 0 if near is None else wanted
        here = near or pose
        height_m, pitch_deg = live.camera_m + draws.height_error_m(), draws.pitch_error_deg()
        moved_m = live.bodies_m(self.layouts[layout]) if others else ()
        shot = first_person_shot(*here, height_m=height_m, pitch_deg=pitch_deg, moved_m=moved_m)
        return PlacedTake(draws, here, layout, height_m, pitch_deg, shot)

    def _near(self, body: Body, pose: Pose, draws: Draws) -> Pose | None:
        """The pose with errors of distance along x and z and of angle, where the body is free; None where it is not."""
        heading_deg = (pose[2] + draws.angle_error_deg()) % 360
        for _ in range(TAKE_TRIES):
            place_m = np.add(pose[:2], (draws.distance_error_m(), draws.distance_error_m()))
            if self._may_be(place_m) and is_free(body, place_m):
                return float(place_m[0]), float(place_m[1]), heading_deg
        return None

    def _may_be(self, place_m: np.ndarray) -> bool:
        """Whether a place lies in the square of a cell."""
        return bool((np.abs(self._cells_m - place_m).max(axis=1) <= self._half_m).any())


def rearranges(perturbations: Perturbations) -> bool:
    """Whether takes see the room's furniture elsewhere than it was built."""
    return any(getattr(perturbations, name) for name in REARRANGING)


def layouts(live: LiveRoom, settings: ViewSettings) -> list[Arrangement]:
    """The room as it was built, then its other layouts; no two takes of a pose are in the same of these."""
    wanted = settings.perturbations
    found = [live.as_built()]
    if not rearranges(wanted):
        return found
    states = np.flatnonzero(live.scene.components == 0)
    for number in range(max(LEAST_LAYOUTS, settings.takes)):
        rng = stream(live, settings, LAYOUTS, number)
        start, target = rng.choice(states, 2, replace=False).tolist()
        found.append(layout_of_episode(live, start, target, Draws(int(rng.integers(2**63)), wanted)))
    return found


def take_seeds(rng: np.random.Generator, settings: ViewSettings) -> list[int]:
    """Of the takes of one pose."""
    return rng.integers(2**63, size=settings.takes).tolist()


def is_free(body: Body, place_m: np.ndarray) -> bool:
    """Whether a body touches nothing at a place; it is left there."""
    body.stand_at(place_m)
    return not body.touches


def stream(live: LiveRoom, settings: ViewSettings, kind: int, number: int) -> np.random.Generator:
    """Random numbers of one pose, of one layout, or of one state."""
    key = zlib.crc32(f"clearway views: {live.scene.name}".encode())
    return np.random.default_rng([key, settings.seed, kind, number])
