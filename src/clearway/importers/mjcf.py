"""Any MuJoCo model as a scene: where the agent's body fits as the model starts, and pictures from there.

Coordinates: x is the model's x, z (across the floor) is the model's y, and heights are the model's z, so that heading 0
looks along the model's y and 90 along its x. The state is the model's first, `qpos0`; nothing moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clearway.importers.mjcf_floor import FloorChoice
from clearway.importers.mjcf_world import SHOWN_GROUPS, ModelWorld, open_world
from clearway.importers.picture_limits import check_picture_count, check_picture_size
from clearway.rooms.camera import PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX, first_person_view
from clearway.rooms.obstacles import AgentShape, bounding_boxes
from clearway.rooms.sense import sense
from clearway.rooms.topview import PIXELS_PER_M, render_from_above
from clearway.scenes.scene import Scene, TopView
from clearway.scenes.sensors import RGB, SENSORS, check_names
from clearway.scenes.validate import check_moves, check_scene

HIDDEN_GROUP = 5
TOP_VIEW_SIDE_PX = 1_024  # at most
MARGIN_M = 1.0  # of the view from above, around the free cells
SMALLER = "Give a smaller --extent or a larger --step"


def read_mjcf(
    path: Path,
    choice: FloorChoice | None = None,
    agent: AgentShape | None = None,
    *,
    name: str | None = None,
    height_px: int = PICTURE_HEIGHT_PX,
    width_px: int = PICTURE_WIDTH_PX,
    sensors: Sequence[str] = (RGB,),
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
    trust: bool = False,
) -> Scene:
    """The scene that an MJCF file describes, with pictures in memory and without features.

    Args:
        path: the file; meshes, textures and included files lie where it says, in its folder.
        choice: what the file does not say.
        agent: the agent's body and step.
        name: of the scene; None: the file's.
        height_px: of a picture.
        width_px: of a picture.
        sensors: what takes the pictures, names of `clearway.scenes.sensors.SENSORS`; "rgb" among them.
        workers: number of renderer processes; None: one a core.
        ray: a Ray cluster that renders instead, see `ray_cluster.connected`.
        progress: show a progress bar, if standard error is a terminal.
        trust: the files that it names may lie outside its folder.

    Raises:
        SceneError: the model names what it may not, MuJoCo refuses it, the world is too large, the agent fits nowhere,
            or a sensor is unknown.
        RenderError: MuJoCo cannot render on this machine.
    """
    check_names(sensors)
    title = path.stem if name is None else name
    check_picture_size(path, height_px, width_px)
    world = open_world(path, choice, agent, trust=trust)
    grid, model, floor_m = world.grid, world.model, world.choice.floor_m
    pose_bytes = sum(SENSORS[name](height_px, width_px).kept_bytes for name in sensors)
    check_picture_count(path, len(grid.graph), height_px, width_px, SMALLER, pose_bytes)
    check_moves(grid.graph, path)
    view = first_person_view(
        grid.state_locations_m,
        grid.state_headings_deg,
        camera_m=floor_m + world.choice.camera_m,
        height_px=height_px,
        width_px=width_px,
        groups=SHOWN_GROUPS,
    )
    pictures, further = sense(model, view, sensors, title=title, workers=workers, ray=ray, progress=progress)
    scene = Scene(
        name=title,
        observations=pictures,
        features=None,
        locations_m=grid.state_locations_m,
        headings_deg=grid.state_headings_deg,
        graph=grid.graph,
        made_by=world.provenance(),
        cell_size_m=world.agent.step_m,
        top_view=_from_above(world),
        further=further,
    )
    check_scene(scene, path)
    return scene


def _from_above(world: ModelWorld) -> TopView:
    """The free cells and what is around them, without what hangs over the agent's head; hides that in the model."""
    model, locations_m = world.model, world.grid.locations_m
    low_m = np.maximum(locations_m.min(axis=0) - MARGIN_M, world.floor.low_m)
    high_m = np.minimum(locations_m.max(axis=0) + MARGIN_M, world.floor.high_m)
    centres_m, halves_m = bounding_boxes(model, world.data)
    overhead_m = world.choice.floor_m + world.agent.height_m
    model.geom_group[centres_m[:, 2] - halves_m[:, 2] > overhead_m] = HIDDEN_GROUP
    return render_from_above(
        model,
        (float(low_m[0]), float(low_m[1])),
        (float(high_m[0]), float(high_m[1])),
        camera_m=world.top_m + 1,
        pixels_per_m=min(PIXELS_PER_M, TOP_VIEW_SIDE_PX / float((high_m - low_m).max())),
        groups=SHOWN_GROUPS,
    )
