"""The views of one room, drawn, measured and rendered in this process."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.live.live_room import live_room
from clearway.rooms.detail import are_small
from clearway.rooms.sense import sense
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import Readings
from clearway.views.placing import rearranges
from clearway.views.poses import draw_takes
from clearway.views.settings import ViewSettings
from clearway.views.table import ViewTable


@dataclass(frozen=True, eq=False)
class RoomViews:
    """The views of a room, N pictures.

    Attributes:
        table: what is known of them.
        rgb: (N, height, width, 3) uint8.
        further: what other sensors measured.
    """

    table: ViewTable
    rgb: np.ndarray
    further: tuple[Readings, ...]


def room_views(scene: Scene, settings: ViewSettings) -> RoomViews:
    """Build the room of a scene, and take its views here; this process needs `renderer_environment`.

    Raises:
        SceneError: the scene is no room to walk in, or has no cell to take pictures in, or nothing that could be moved.
        RenderError: this machine cannot render.
    """
    small = are_small(*settings.size_px)
    live = live_room(scene, small=small, loose=rearranges(settings.perturbations))
    taken = draw_takes(live, scene.held_out, settings)
    view = replace(live.lens(*settings.size_px, fast=small), shots=taken.shots)
    pictures, further = sense(live.model, view, settings.sensors, title=scene.name, here=True)
    for number, draws in enumerate(taken.draws):
        pictures[number] = draws.seen(pictures[number])
    return RoomViews(taken.table, pictures, further)
