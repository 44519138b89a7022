"""A small room to walk in live: two boxes of furniture on an empty floor, walls of four colours, a tiny encoder."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.live.live_room import LiveRoom, camera_model
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import ResNetShape, fit_record, from_record
from clearway.rooms.camera import first_person_view
from clearway.rooms.navigation import find_grid
from clearway.rooms.pieces import loose_obstacles
from clearway.rooms.render import render
from clearway.scenes.scene import Provenance, Scene
from helpers.small_rooms import SmallRoom

FURNITURE = (((0.65, 0.85), (0.65, 0.85), (0.9, 0.1, 0.9)), ((1.6, 1.9), (2.1, 2.4), (0.1, 0.9, 0.9)))
TILES = 40
TINY = ResNetShape(embedding_size=4, hidden_sizes=(8, 16), depths=(1, 1), layer_type="basic")


@dataclass
class WalkableRoom(SmallRoom):
    """2 x 2.5 m, 20 cells but for two under the furniture."""

    name: str = "walkable"
    depth_m: float = 2.5


def walkable_room() -> WalkableRoom:
    """Even light, coloured tiles on the walls; furniture hangs loose as `build_room(..., loose=True)` has it."""
    room, rng = WalkableRoom(), np.random.default_rng(0)
    room.spec.visual.headlight.ambient[:] = [1, 1, 1]
    room.spec.visual.headlight.diffuse[:] = room.spec.visual.headlight.specular[:] = [0, 0, 0]
    room.spec.stat.extent, room.spec.stat.center = 5.0, [1.0, 1.25, 1.0]
    for side, along, height, *rgb in rng.random((TILES, 6)):
        x_m = (2 * along - 0.15, 2 * along + 0.15) if side < 0.5 else ((0, 0.01) if side < 0.75 else (1.99, 2))
        z_m = (2.5 * along - 0.15, 2.5 * along + 0.15) if side >= 0.5 else ((0, 0.01) if side < 0.25 else (2.49, 2.5))
        room.add_box(x_m, z_m, (2 * height, 2 * height + 0.4), group=2, rgb=tuple(rgb))
    for x_m, z_m, rgb in FURNITURE:
        room.add_box(x_m, z_m, (0.0, 0.9))
        shape = loose_obstacles(room.spec)[-1]
        geom = room.spec.worldbody.add_body(mocap=True).add_geom(type=shape.type, pos=shape.pos, size=shape.size)
        geom.rgba, geom.group, geom.contype, geom.conaffinity = [*rgb, 1], 2, 0, 0
    return room


def walkable_scene(room: WalkableRoom) -> Scene:
    """The grid of the room with its pictures, and features by a tiny random encoder."""
    grid = find_grid(room)
    model = room.spec.compile()
    pictures = render(model, first_person_view(grid.state_locations_m, grid.state_headings_deg), workers=1)
    record = fit_record([pictures], shape=TINY, preprocessing=Preprocessing(16, 16), sample_pictures=32, name="tiny")
    return Scene(
        name="walkable",
        observations=pictures,
        features=from_record(record).encode(pictures),
        locations_m=grid.state_locations_m,
        headings_deg=grid.state_headings_deg,
        graph=grid.graph,
        made_by=Provenance("room", room="bathroom", seed=0),
        encoder=record,
    )


def walkable_live() -> LiveRoom:
    """Scene, obstacles and what the camera sees."""
    room = walkable_room()
    scene = walkable_scene(room)
    return LiveRoom(scene, room, camera_model(room.spec))


def state_at(scene: Scene, x_m: float, z_m: float, heading_deg: int) -> int:
    """The state of a pose."""
    here = np.isclose(scene.locations_m, (x_m, z_m)).all(axis=1) & (scene.headings_deg == heading_deg)
    (state,) = np.flatnonzero(here)
    return int(state)
