"""Any MuJoCo model as a scene: where the agent's body fits as the model starts, and pictures from there.

Coordinates: x is the model's x, z (across the floor) is the model's y, and heights are the model's z, so that heading 0
looks along the model's y and 90 along its x. The state is the model's first, `qpos0`; nothing moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import mujoco
import numpy as np

from clearway.errors import SceneError
from clearway.importers.mjcf_compile import compiled
from clearway.importers.mjcf_floor import FloorChoice, find_cells, floor_of, span_of
from clearway.importers.picture_limits import check_picture_count, check_picture_size
from clearway.rooms.build import shaping_versions
from clearway.rooms.camera import PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX, first_person_view
from clearway.rooms.navigation import Floor
from clearway.rooms.obstacles import AgentShape, bounding_boxes
from clearway.rooms.sense import sense
from clearway.rooms.topview import PIXELS_PER_M, render_from_above
from clearway.scenes.scene import Provenance, Scene, TopView
from clearway.scenes.sensors import RGB, SENSORS, check_names
from clearway.scenes.validate import check_moves, check_scene

SOURCE = "mjcf"
SHOWN_GROUPS = (0, 1, 2)  # as MuJoCo's own viewer starts
HIDDEN_GROUP = 5
TOP_VIEW_SIDE_PX = 1_024  # at most
NEAR_M = 0.05  # nothing nearer is drawn
MARGIN_M = 1.0  # of the view from above, around the free cells
SMALLER = "Give a smaller --extent or a larger --step"


def read_mjcf(
    path: Path,
    world: FloorChoice | None = None,
    agent: AgentShape | None = None,
    *,
    name: str | None = None,
    height_px: int = PICTURE_HEIGHT_PX,
    width_px: int = PICTURE_WIDTH_PX,
    sensors: Sequence[str] = (RGB,),
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
) -> Scene:
    """The scene that an MJCF file describes, with pictures in memory and without features.

    Args:
        path: the file; meshes, textures and included files lie where it says.
        world: what the file does not say.
        agent: the agent's body and step.
        name: of the scene; None: the file's.
        height_px: of a picture.
        width_px: of a picture.
        sensors: what takes the pictures, names of `clearway.scenes.sensors.SENSORS`; "rgb" among them.
        workers: number of renderer processes; None: one a core.
        ray: a Ray cluster that renders instead, see `ray_cluster.connected`.
        progress: show a progress bar, if standard error is a terminal.

    Raises:
        SceneError: MuJoCo refuses the model, the world is too large, the agent fits nowhere, or a sensor is unknown.
        RenderError: MuJoCo cannot render on this machine.
    """
    check_names(sensors)
    world, agent = world or FloorChoice(), agent or AgentShape()
    title = path.stem if name is None else name
    _check_body(path, agent)
    check_picture_size(path, height_px, width_px)
    model = compiled(path, agent)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    floor = floor_of(path, model, data, world, agent.step_m)
    grid = find_cells(path, model, data, floor, world, agent)
    pose_bytes = sum(SENSORS[name](height_px, width_px).kept_bytes for name in sensors)
    check_picture_count(path, len(grid.graph), height_px, width_px, SMALLER, pose_bytes)
    check_moves(grid.graph, path)
    top_m = _set_lens(model, data, floor, world.floor_m)
    view = first_person_view(
        grid.state_locations_m,
        grid.state_headings_deg,
        camera_m=world.floor_m + world.camera_m,
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
        made_by=Provenance(
            SOURCE,
            versions=shaping_versions(),
            notes={"file": path.name, "world": asdict(world), "agent": asdict(agent)},
        ),
        cell_size_m=agent.step_m,
        top_view=_from_above(model, data, floor, grid.locations_m, world.floor_m + agent.height_m, top_m),
        further=further,
    )
    check_scene(scene, path)
    return scene


def _check_body(path: Path, agent: AgentShape) -> None:
    """Refuse a body that cannot be. Raises SceneError."""
    if agent.height_m <= 2 * agent.radius_m:
        problem = f"an agent {agent.height_m:g} m high and {2 * agent.radius_m:g} m wide is no standing capsule"
        raise SceneError(path, problem, "Make it higher or thinner")


def _set_lens(model: mujoco.MjModel, data: mujoco.MjData, floor: Floor, floor_m: float) -> float:
    """Draw from `NEAR_M` up to beyond everything finite (models' own limits are meant for a view of the whole).

    Returns:
        Height of the highest finite thing, or of the floor where that is higher.
    """
    low_m, high_m = span_of(model, data)
    low_m = np.minimum(low_m, (*floor.low_m, floor_m))
    high_m = np.maximum(high_m, (*floor.high_m, floor_m))
    model.stat.extent = 1.0  # what the limits are multiples of
    model.vis.map.znear = NEAR_M
    model.vis.map.zfar = 2 * float(np.linalg.norm(high_m - low_m)) + 100
    return float(high_m[2])


def _from_above(
    model: mujoco.MjModel, data: mujoco.MjData, floor: Floor, locations_m: np.ndarray, overhead_m: float, top_m: float
) -> TopView:
    """The free cells and what is around them, without what hangs over the agent's head; hides that in `model`."""
    low_m = np.maximum(locations_m.min(axis=0) - MARGIN_M, floor.low_m)
    high_m = np.minimum(locations_m.max(axis=0) + MARGIN_M, floor.high_m)
    centres_m, halves_m = bounding_boxes(model, data)
    model.geom_group[centres_m[:, 2] - halves_m[:, 2] > overhead_m] = HIDDEN_GROUP
    return render_from_above(
        model,
        (float(low_m[0]), float(low_m[1])),
        (float(high_m[0]), float(high_m[1])),
        camera_m=top_m + 1,
        pixels_per_m=min(PIXELS_PER_M, TOP_VIEW_SIDE_PX / float((high_m - low_m).max())),
        groups=SHOWN_GROUPS,
    )
