"""Build a room as a `Scene`: furniture and light, the graph of poses, and a picture of every pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from importlib.metadata import version

import numpy as np

from clearway.rooms.camera import PICTURE_SIZE_PX
from clearway.rooms.detail import DETAIL_NOTE, DETAILS, are_small, detail_for
from clearway.scenes import floor_plans, plan_scenes
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.sensors import RGB, check_names
from clearway.scenes.validate import check_moves
from clearway.version import __version__


def build_scene(
    name: str,
    seed: int = 0,
    *,
    sensors: Sequence[str] = (RGB,),
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
) -> Scene:
    """One of our own rooms as a scene with pictures, held in memory, and without features.

    Args:
        name: of the room, one of `clearway.rooms.ROOM_NAMES`.
        seed: 0 is the default room; another gives other colours, pictures and small furniture.
        sensors: what takes the pictures, names of `clearway.scenes.sensors.SENSORS`; "rgb" among them.
        workers: number of renderer processes; None: one a core.
        ray: a Ray cluster that renders instead, see `ray_cluster.connected`.
        progress: show what is going on, if standard error is a terminal.

    Raises:
        SceneError: there is no such room or sensor, or the agent fits nowhere in it.
        RenderError: MuJoCo cannot render on this machine.
    """
    check_names(sensors)
    check_mujoco()
    from clearway.rooms import build_room
    from clearway.rooms.camera import first_person_view
    from clearway.rooms.navigation import find_grid
    from clearway.rooms.obstacles import AgentShape
    from clearway.rooms.sense import sense
    from clearway.rooms.topview import render_top_view

    title, agent = scene_name(name, seed), AgentShape()
    with _status(f"furnishing and lighting {title}", progress):
        room = build_room(name, seed)
        grid = find_grid(room, agent)
        model = room.spec.compile()
    top_view = render_top_view(model, room.width_m, room.depth_m)
    view = first_person_view(grid.state_locations_m, grid.state_headings_deg)
    pictures, further = sense(model, view, sensors, title=title, workers=workers, ray=ray, progress=progress)
    return Scene(
        name=title,
        observations=pictures,
        features=None,
        locations_m=grid.state_locations_m,
        headings_deg=grid.state_headings_deg,
        graph=grid.graph,
        made_by=Provenance(source="room", room=name, seed=seed, versions=shaping_versions()),
        cell_size_m=agent.step_m,
        top_view=top_view,
        further=further,
    )


def build_floor_plan(
    plan: FloorPlan,
    seed: int = 0,
    *,
    sensors: Sequence[str] = (RGB,),
    size_px: tuple[int, int] = PICTURE_SIZE_PX,
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
    here: bool = False,
) -> Scene:
    """A floor plan as a furnished room: its cells and edges exactly, with pictures, and without features.

    The pictures are held in memory, 1.4 MB a cell at 300 x 400 pixels.

    Args:
        plan: the plan. Parts of it that cannot be reached from each other stay in the scene.
        seed: with the plan's name chooses furniture, colours and textures.
        sensors: what takes the pictures, names of `clearway.scenes.sensors.SENSORS`; "rgb" among them.
        size_px: height and width of the pictures; small ones are taken fast, of a room in small detail (`detail`).
        workers: number of renderer processes; None: one a core.
        ray: a Ray cluster that renders instead, see `ray_cluster.connected`.
        progress: show what is going on, if standard error is a terminal.
        here: this process renders, see `rooms.render.render`.

    Raises:
        SceneError: the plan's cells, their number or its extent are no room's, the seed is negative, or there is no
            such sensor.
        RenderError: MuJoCo cannot render on this machine.
    """
    check_names(sensors)
    check_mujoco()
    from clearway.rooms.camera import first_person_view
    from clearway.rooms.plans.plan_room import build_plan_room
    from clearway.rooms.sense import sense
    from clearway.rooms.topview import render_top_view

    locations_m, headings_deg, graph = plan_scenes.plan_poses(plan)
    check_moves(graph, plan.source or plan.name)
    detail = detail_for(*size_px)
    with _status(f"furnishing and lighting {plan.name}", progress):
        room, layout = build_plan_room(plan, seed, detail=DETAILS[detail])
        model = room.spec.compile()
    top_view = render_top_view(model, room.width_m, room.depth_m, here=here)
    x_m, z_m = layout.origin_m
    (height_px, width_px), inside_m = size_px, locations_m - np.array(layout.origin_m)
    view = first_person_view(inside_m, headings_deg, height_px=height_px, width_px=width_px, fast=are_small(*size_px))
    pictures, further = sense(
        model, view, sensors, title=plan.name, workers=workers, ray=ray, progress=progress, here=here
    )
    return Scene(
        name=plan.name,
        observations=pictures,
        features=None,
        locations_m=locations_m,
        headings_deg=headings_deg,
        graph=graph,
        made_by=Provenance(
            floor_plans.SOURCE,
            seed=seed,
            versions=shaping_versions(),
            notes={**plan_scenes.plan_notes(plan), DETAIL_NOTE: detail},
        ),
        cell_size_m=plan.cell_size_m,
        top_view=replace(
            top_view,
            x_min_m=top_view.x_min_m + x_m,
            x_max_m=top_view.x_max_m + x_m,
            z_min_m=top_view.z_min_m + z_m,
            z_max_m=top_view.z_max_m + z_m,
        ),
        further=further,
    )


def scene_name(name: str, seed: int) -> str:
    """What the scene of a room is called: the room's name, and the seed if it is not the default room."""
    return name if seed == 0 else f"{name}-{seed}"


def shaping_versions() -> dict[str, str]:
    """Versions of the packages that shape a room's pictures."""
    return {"clearway": __version__, **{package: version(package) for package in ("mujoco", "numpy", "scipy")}}


def check_mujoco() -> None:
    """Import MuJoCo, which fails in many ways if `MUJOCO_GL` names a backend that is not there."""
    try:
        import_module("mujoco")
    except (ImportError, AttributeError, RuntimeError, OSError) as error:
        from clearway.rooms.render_worker import cannot_draw

        raise cannot_draw(f"{type(error).__name__}: {error}") from error


@contextmanager
def _status(message: str, wanted: bool) -> Iterator[None]:
    """A moving line on standard error while something without countable steps goes on."""
    from rich.console import Console

    console = Console(stderr=True)
    if not (wanted and console.is_terminal):
        yield
        return
    with console.status(message):
        yield
