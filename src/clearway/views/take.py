"""The views of one room, drawn, measured and rendered in this process."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.live.live_room import live_room
from clearway.rooms.camera import eye_view
from clearway.rooms.sense import sense
from clearway.scenes.held_out import held_out
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import Readings
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
        SceneError: the scene is no room to walk in, or has no cell to take pictures in.
        RenderError: this machine cannot render.
    """
    live = live_room(scene)
    taken = draw_takes(live, held_out(scene), settings)
    height_px, width_px = settings.size_px
    fast = height_px % 2 == 0 and width_px % 2 == 0
    view = eye_view(taken.shots, height_px=height_px, width_px=width_px, fast=fast)
    pictures, further = sense(live.model, view, settings.sensors, title=scene.name, here=True)
    for number, draws in enumerate(taken.draws):
        pictures[number] = draws.seen(pictures[number])
    return RoomViews(taken.table, pictures, further)
