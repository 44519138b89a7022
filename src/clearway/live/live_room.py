"""The room of a scene, built again: its obstacles for the body, and a model of it for the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.scene import Scene

if TYPE_CHECKING:
    import mujoco

    from clearway.rooms.obstacles import CollisionRoom

NEW_OBSTACLE_RGBA = (0.72, 0.36, 0.24, 1.0)


@dataclass(frozen=True, eq=False)
class LiveRoom:
    """A room to walk in.

    Attributes:
        scene: the grid of it that the agent knows.
        room: its obstacles.
        model: what the camera sees; every piece of furniture, and last the new obstacle, is a mocap body.
    """

    scene: Scene
    room: CollisionRoom
    model: mujoco.MjModel


def live_room(scene: Scene) -> LiveRoom:
    """Build the room of a scene again, some seconds.

    Raises:
        SceneError: the scene is none of our rooms, or this version builds the room differently.
    """
    made = scene.made_by
    if made.source != "room" or made.room is None or made.seed is None:
        raise SceneError(
            scene.name,
            f"there is no room to walk in: the scene comes from {made.source}",
            "Walk live in a scene that clearway scenes build made",
        )
    from clearway.rooms.build import check_mujoco

    check_mujoco()
    from clearway.rooms import build_room
    from clearway.rooms.navigation import find_grid

    grid = find_grid(build_room(made.room, made.seed, looks=False))
    if not np.array_equal(grid.graph, scene.graph) or not np.allclose(grid.state_locations_m, scene.locations_m):
        raise SceneError(
            scene.name,
            f"room {made.room} with seed {made.seed} has another grid in this version than in the file",
            "Build the scene again and train on it",
            "graph",
        )
    room = build_room(made.room, made.seed, loose=True)
    return LiveRoom(scene, room, camera_model(room.spec))


def camera_model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled room with the new obstacle on a body of its own, out of sight."""
    from clearway.live.arrangement import OUT_OF_SIGHT_M, add_new_obstacle
    from clearway.rooms.groups import SEEN_GROUP

    body = spec.worldbody.add_body(name="new obstacle", mocap=True, pos=OUT_OF_SIGHT_M)
    geom = add_new_obstacle(body, (0.0, 0.0, 0.0), SEEN_GROUP)
    geom.rgba[:] = NEW_OBSTACLE_RGBA
    geom.contype = geom.conaffinity = 0
    return spec.compile()
