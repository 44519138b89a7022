"""Where pictures of a room are taken from: random free poses, and for each its takes with their perturbations.

A pose lies anywhere in the square of a free cell of the scene's largest part, where the body touches nothing; all such
places are equally likely. Its cell is thereby the nearest one, so that poses keep away from held-out cells, or to them.
A take moves and turns the camera a little, and stands in one of some layouts of the furniture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.errors import SceneError
from clearway.live.body import Body
from clearway.live.draws import Draws
from clearway.live.live_room import LiveRoom
from clearway.live.walker import Pose, Walker
from clearway.live_envs.arguments import CLEARANCE_REACH_M
from clearway.perception.around import PLACES_M
from clearway.rooms.camera import Shot
from clearway.views.placing import POSES, TakePlaces, is_free, stream, take_seeds
from clearway.views.settings import ViewSettings
from clearway.views.table import COLUMNS, TURNS_DEG, ViewTable, table_of

REACH_M = CLEARANCE_REACH_M
MOST_TRIES = 1000  # at a place for a pose
WAY_STEPS = (
    (0.5, 10),
    (0.05, 9),
    (0.01, 4),
)  # lengths in metres and numbers that a free way is found by, up to REACH_M


@dataclass(frozen=True, eq=False)
class Taken:
    """What is to be taken of a room, N pictures.

    Attributes:
        shots: N camera places.
        draws: N, the chances of each picture, for its light and noise.
        table: what is known of them, in the coordinates of the scene as it is kept.
    """

    shots: tuple[Shot, ...]
    draws: tuple[Draws, ...]
    table: ViewTable


def draw_takes(live: LiveRoom, held_out: np.ndarray, settings: ViewSettings) -> Taken:
    """Poses of a room and their takes, pose after pose.

    Args:
        live: the room.
        held_out: (S,) bool, its poses that are held out.
        settings: how many, and how they are drawn.

    Raises:
        SceneError: the room has no cell to take them in, or nothing that could be moved.
    """
    places = _Places(live, held_out == settings.held_out, settings)
    takes = TakePlaces(live, places.cells_m, settings)
    rows, shots, chances = [], [], []
    for number in range(settings.poses):
        rng = stream(live, settings, POSES, number)
        pose = places.drawn(takes.bodies[0], rng)
        for take, seed in enumerate(take_seeds(rng, settings)):
            one = takes.placed(pose, number, take, seed)
            x_m, z_m = np.add(one.pose[:2], live.origin_m).tolist()
            placed = (number, take, one.layout, x_m, z_m, one.pose[2], one.height_m, one.pitch_deg)
            rows.append((*placed, *_felt(takes.bodies[one.layout], one.pose, one.draws, live)))
            shots.append(one.shot)
            chances.append(one.draws)
    assert len(rows[0]) == len(COLUMNS)
    return Taken(tuple(shots), tuple(chances), table_of(np.array(rows, np.float64)))


class _Places:
    """Where in a room poses may be.

    Args:
        live: the room.
        wanted: (S,) bool, the states next to which they may be.
        settings: how headings are drawn.

    Attributes:
        cells_m: (C, 2), the middles of those cells.
    """

    def __init__(self, live: LiveRoom, wanted: np.ndarray, settings: ViewSettings) -> None:
        scene = live.scene
        self._half_m = scene.cell_size_m / 2
        self.cells_m = np.unique(scene.locations_m[wanted & (scene.components == 0)], axis=0)
        if not len(self.cells_m):
            what = "no held-out cell" if settings.held_out else "no cell that is not held out"
            raise SceneError(scene.name, f"has {what} in its largest part", "Leave the scene out")
        self._headings_deg = np.unique(scene.headings_deg) if settings.scene_headings else None

    def drawn(self, body: Body, rng: np.random.Generator) -> Pose:
        """A free pose; where hardly any place is free, the middle of a cell, which is."""
        headings_deg = self._headings_deg
        heading_deg = rng.uniform(0, 360) if headings_deg is None else rng.choice(headings_deg)
        for _ in range(MOST_TRIES):
            cell_m = self.cells_m[rng.integers(len(self.cells_m))]
            place_m = cell_m + rng.uniform(-self._half_m, self._half_m, 2)
            if is_free(body, place_m):
                return float(place_m[0]), float(place_m[1]), float(heading_deg)
        return float(cell_m[0]), float(cell_m[1]), float(heading_deg)


def _felt(body: Body, pose: Pose, draws: Draws, live: LiveRoom) -> Sequence[float]:
    """Zone, clearance, free ways and where the body could stand, at a pose: the last columns of the table."""
    scene = live.scene
    walker = Walker(body, pose, draws, step_m=scene.cell_size_m, turn_deg=scene.turn_deg, measured=False)
    ways_m = (_free_way_m(body, pose[2] + turn_deg) for turn_deg in TURNS_DEG)
    felt = (float(walker.zone()), max(0.0, body.gap_m(REACH_M)), *ways_m)
    return *felt, *_stands(body, pose[2], live)


def _stands(body: Body, heading_deg: float, live: LiveRoom) -> list[float]:
    """Whether the body could stand at each of `PLACES_M`, a cell or less from one of the scene."""
    start_m, heading = body.place_m, np.radians(heading_deg)
    ahead = np.array([[np.sin(heading), np.cos(heading)], [np.cos(heading), -np.sin(heading)]])
    places_m = start_m + np.array(PLACES_M) @ ahead
    cells_m = np.unique(live.scene.locations_m, axis=0)
    inside = np.abs(places_m[:, None] - cells_m).max(axis=2).min(axis=1) <= live.scene.cell_size_m
    found = [float(near and is_free(body, place_m)) for near, place_m in zip(inside.tolist(), places_m, strict=True)]
    body.stand_at(start_m)
    return found


def _free_way_m(body: Body, heading_deg: float) -> float:
    """How far a body could move along a heading until it touches something, in whole centimetres; it stays there."""
    start_m, heading, way_m = body.place_m, np.radians(heading_deg), 0.0
    for step_m, most in WAY_STEPS:
        body.stand_at(start_m + way_m * np.array([np.sin(heading), np.cos(heading)]))
        way_m += step_m * body.free_steps(step_m, heading_deg, most)
        if way_m >= REACH_M:
            break
    body.stand_at(start_m)
    return round(way_m, 2)
