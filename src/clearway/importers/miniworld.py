"""Environments of MiniWorld (Chevalier-Boisvert et al., 2023), photographed through the package `miniworld`.

A grid of the chosen step, its first cell half a step from the corner of the world; four headings a cell. A cell is
free where MiniWorld's own test of the agent's circle against walls and objects says so, within one of its rooms; a move
is free where that holds all along it. Objects stay where the seed puts them: they block and are seen.

MiniWorld's y points up and its z away from ours: our z is its -z, and heading 0 looks along it.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.metadata import version
from typing import Any

import numpy as np

from clearway.errors import SceneError, install_hint
from clearway.importers.picture_limits import check_picture_count, check_picture_size
from clearway.progress import work_progress
from clearway.scenes.grid import HEADING_COUNT, connected_parts, edges_among, neighbour_pairs, pose_graph
from clearway.scenes.scene import Provenance, Scene, TopView
from clearway.scenes.validate import check_scene
from clearway.version import __version__

SOURCE = "miniworld"
MAX_GRID_POINTS = 1 << 16  # places where the agent is tried
SWEEP_M = 0.05  # along a move, the agent's circle is tried this often
BESIDE_M = 1e-3  # the border between two rooms lies in neither; a point this near counts
ROUNDING = 1e-9  # 2.1 / 0.7 is a little less than 3
TOP_VIEW_PX = (600, 800)  # height, width
SAMPLES = 8  # a pixel, for smooth edges
FEWER = "Give a larger --step"
NO_SCREEN = "It needs OpenGL without a screen: on Debian or Ubuntu, apt-get install libegl1 libgl1 libglu1-mesa"


@contextmanager
def started(name: str, seed: int = 0) -> Iterator[Any]:
    """A MiniWorld environment, reset and without its wrappers; closed in the end.

    Args:
        name: as registered with Gymnasium, "MiniWorld-Hallway-v0" or, of a module of your own, "module:Name-v0".
        seed: of the world.

    Raises:
        SceneError: the package is not installed, there is no such environment, or it does not start here.
    """
    try:
        import pyglet

        pyglet.options["headless"] = sys.platform == "linux"  # before anything of it opens a window
        from miniworld.miniworld import MiniWorldEnv
    except ModuleNotFoundError as error:
        raise SceneError(name, "needs the package miniworld", install_hint("miniworld")) from error
    except Exception as fault:  # a missing library is an ImportError, AttributeError or pyglet's own exception
        raise SceneError(name, f"MiniWorld does not start here ({_line(fault)})", NO_SCREEN) from fault
    import gymnasium

    try:
        with redirect_stdout(io.StringIO()):  # MiniWorld prints what its frame buffers fall back to
            env = gymnasium.make(name, disable_env_checker=True)
            env.reset(seed=seed)
    except gymnasium.error.Error as fault:
        raise SceneError(name, f"there is no such environment ({_line(fault)})", "Check its name") from fault
    except Exception as fault:  # the environment is other people's code
        raise SceneError(name, f"MiniWorld cannot make it ({_line(fault)})", NO_SCREEN) from fault
    try:
        if not isinstance(env.unwrapped, MiniWorldEnv):
            raise SceneError(name, "is no environment of MiniWorld", "Name one, for example MiniWorld-FourRooms-v0")
        yield env.unwrapped
    finally:
        env.close()


def photographed(
    env: Any, name: str, *, step_m: float, seed: int = 0, height_px: int, width_px: int, progress: bool = False
) -> Scene:
    """The scene that a MiniWorld environment shows, with pictures in memory and without features.

    Args:
        env: `miniworld.miniworld.MiniWorldEnv`, reset.
        name: of the scene.
        step_m: length of a move.
        seed: that the environment was reset with, for the record.
        height_px: of a picture.
        width_px: of a picture.
        progress: show a progress bar, if standard error is a terminal.

    Raises:
        SceneError: the world is too large for the step, or the agent fits nowhere.
    """
    check_picture_size(name, height_px, width_px)
    cells, edges = _free_cells(env, name, step_m)
    locations_m = np.repeat(_places(env, cells, step_m), HEADING_COUNT, axis=0)
    headings_deg = np.tile(np.arange(HEADING_COUNT) * 90, len(cells))
    check_picture_count(name, len(headings_deg), height_px, width_px, FEWER)
    versions = {"clearway": __version__, "miniworld": version("miniworld"), "pyglet": version("pyglet")}
    scene = Scene(
        name=name,
        observations=_pictures(env, name, locations_m, headings_deg, (height_px, width_px), progress),
        features=None,
        locations_m=locations_m,
        headings_deg=headings_deg,
        graph=pose_graph(cells, edges),
        made_by=Provenance(SOURCE, room=name, seed=seed, versions=versions),
        cell_size_m=step_m,
        top_view=_from_above(env),
    )
    check_scene(scene)
    return scene


def _free_cells(env: Any, name: str, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The largest connected part of the free cells, (C, 2) columns and rows, and its free moves, (E, 2)."""
    x_count, z_count = ((high - low) / step_m for low, high in _extent(env))
    if x_count * z_count > MAX_GRID_POINTS:
        problem = f"has {x_count * z_count:,.0f} places to try, expected at most {MAX_GRID_POINTS:,}"
        raise SceneError(name, problem, FEWER)
    columns, rows = int(x_count + ROUNDING), int(z_count + ROUNDING)
    points = np.stack(np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij"), axis=-1).reshape(-1, 2)
    free = np.array([_fits(env, place_m) for place_m in _places(env, points, step_m)], bool)
    if not free.any():
        problem = f"an agent with a radius of {env.agent.radius:g} m fits nowhere on a grid of {step_m:g} m"
        raise SceneError(name, problem, "Give a smaller --step")
    cells = points[free]
    places_m = _places(env, cells, step_m)
    pairs, _ = neighbour_pairs(cells)
    passable = np.array([_passes(env, places_m[near], places_m[far]) for near, far in pairs], bool)
    part, _ = connected_parts(len(cells), pairs[passable])
    return cells[part == 0], edges_among(part == 0, pairs[passable])


def _extent(env: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """Smallest and largest x, and smallest and largest z of ours, metres."""
    return (float(env.min_x), float(env.max_x)), (-float(env.max_z), -float(env.min_z))


def _places(env: Any, cells: np.ndarray, step_m: float) -> np.ndarray:
    """(C, 2) x and z of ours of grid cells (C, 2), metres."""
    (x_low_m, _), (z_low_m, _) = _extent(env)
    return np.array([x_low_m, z_low_m]) + (cells + 0.5) * step_m


def _point(place_m: np.ndarray) -> np.ndarray:
    """MiniWorld's (3,) point on the floor at a place of ours."""
    return np.array([place_m[0], 0.0, -place_m[1]])


def _fits(env: Any, place_m: np.ndarray) -> bool:
    """Whether the agent can stand at a place: within a room, and touching neither wall nor object."""
    nearby = (_point(place_m + beside_m) for beside_m in (0.0, BESIDE_M, -BESIDE_M))
    inside = any(room.point_inside(point) for point in nearby for room in env.rooms)
    return inside and not env.intersect(env.agent, _point(place_m), env.agent.radius)


def _passes(env: Any, start_m: np.ndarray, end_m: np.ndarray) -> bool:
    """Whether the agent fits all along the way between two places."""
    count = int(np.ceil(np.linalg.norm(end_m - start_m) / SWEEP_M))
    return all(_fits(env, start_m + (end_m - start_m) * index / count) for index in range(1, count))


def _pictures(
    env: Any,
    name: str,
    locations_m: np.ndarray,
    headings_deg: np.ndarray,
    size_px: tuple[int, int],
    progress: bool,
) -> np.ndarray:
    """What the agent sees at each pose, (S, height, width, 3) uint8."""
    height_px, width_px = size_px
    buffer = _frame_buffer(height_px, width_px)
    pictures = np.empty((len(headings_deg), height_px, width_px, 3), np.uint8)
    with work_progress(f"photographing {name}", len(pictures), progress) as show_done:
        for state, (place_m, heading_deg) in enumerate(zip(locations_m, headings_deg, strict=True)):
            env.agent.pos = _point(place_m)
            env.agent.dir = np.radians(90.0 - float(heading_deg))  # 0 looks along x, and turns to the left add
            pictures[state] = env.render_obs(buffer)
            show_done(state + 1)
    return pictures


def _from_above(env: Any) -> TopView:
    """The whole world from above, without the agent; MiniWorld centres it in the picture."""
    height_px, width_px = TOP_VIEW_PX
    image, scale = env.render_top_view(_frame_buffer(height_px, width_px), render_agent=False, return_scale=True)
    x_m, z_m = ((low + high) / 2 for low, high in _extent(env))
    half_x_m, half_z_m = width_px / scale["x_scale"] / 2, height_px / scale["z_scale"] / 2
    return TopView(np.asarray(image, np.uint8), x_m - half_x_m, x_m + half_x_m, z_m - half_z_m, z_m + half_z_m)


def _frame_buffer(height_px: int, width_px: int) -> Any:
    """A picture to draw into."""
    from miniworld.opengl import FrameBuffer

    with redirect_stdout(io.StringIO()):
        return FrameBuffer(width_px, height_px, SAMPLES)


def _line(fault: BaseException) -> str:
    """An exception's message in one line."""
    return " ".join(str(fault).split())[:300] or type(fault).__name__
