"""Rooms of AI2-THOR (Kolve et al., 2017), photographed live through the `ai2thor` package.

The positions that the simulator calls reachable on a grid of the chosen step, four headings each, a level camera. Every
teleport is checked: for success, and that the agent stands and looks where it should. Locations where one fails are
left out, with a warning that counts them.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any, Protocol

import numpy as np

from clearway.errors import SceneError, install_hint
from clearway.importers.picture_limits import check_picture_count, check_picture_size
from clearway.importers.pose_graph import recorded_pose_graph
from clearway.progress import work_progress
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.validate import MAX_STATES, SceneWarning, check_scene
from clearway.version import __version__

SOURCE = "ai2thor"
HEADINGS_DEG = (0, 90, 180, 270)
OFF_M, OFF_DEG = 0.01, 1.0  # a teleport that ends farther off than this has failed
TRY_ANOTHER = "Check the scene's name, for example FloorPlan402"


class Controller(Protocol):
    """What is used of `ai2thor.controller.Controller`."""

    def step(self, action: str, **arguments: Any) -> Any:
        """Do an action; the event has `metadata`, a mapping, and `frame`, (height, width, 3) uint8."""

    def stop(self) -> None:
        """End the simulator."""


@contextmanager
def started(scene: str, step_m: float, width_px: int, height_px: int) -> Iterator[Controller]:
    """The simulator in a scene, stopped in the end.

    Raises:
        SceneError: the package is not installed, or its simulator cannot be downloaded or started.
    """
    try:
        from ai2thor.controller import Controller as Simulator
    except ImportError as error:
        raise SceneError(scene, "needs the package ai2thor", install_hint("ai2thor")) from error
    try:
        controller = Simulator(scene=scene, gridSize=step_m, width=width_px, height=height_px, snapToGrid=True)
    except Exception as fault:  # the package raises ValueError, OSError or plain Exception where it finds no simulator
        reason = " ".join(str(fault).split())[:300]
        problem = f"AI2-THOR's simulator cannot be downloaded or started ({reason})"
        remedy = "It needs the network once, and a display or its CloudRendering platform with Vulkan"
        raise SceneError(scene, problem, remedy) from fault
    try:
        yield controller
    finally:
        controller.stop()


def photographed(controller: Controller, name: str, *, step_m: float, progress: bool = False) -> Scene:
    """The scene that a simulator shows, with pictures in memory and without features.

    Args:
        controller: started in the scene, with a grid of `step_m`.
        name: of the scene.
        step_m: length of a move.
        progress: show a progress bar, if standard error is a terminal.

    Raises:
        SceneError: the simulator names no positions or too many, its pictures are too large, or no location can be
            photographed.

    Warns:
        SceneWarning: locations are left out because a teleport to them failed.
    """
    positions = _reachable(controller, name)
    pictures: list[np.ndarray] = []
    places: list[tuple[float, float]] = []
    with work_progress(f"photographing {name}", len(positions) * len(HEADINGS_DEG), progress) as show_done:
        for number, position in enumerate(positions, 1):
            frames = _all_round(controller, position)
            show_done(number * len(HEADINGS_DEG))
            if frames is not None:
                pictures += frames
                places.append((float(position["x"]), float(position["z"])))
    if not places:
        raise SceneError(name, f"no teleport to any of {len(positions)} positions succeeded", TRY_ANOTHER)
    if len(places) < len(positions):
        count = len(positions) - len(places)
        message = f"{name}: {count} of {len(positions)} locations are left out: a teleport there failed"
        warnings.warn(message, SceneWarning, stacklevel=2)
    locations_m = np.repeat(np.array(places), len(HEADINGS_DEG), axis=0)
    headings_deg = np.tile(np.array(HEADINGS_DEG, np.int64), len(places))
    scene = Scene(
        name=name,
        observations=np.stack(pictures),
        features=None,
        locations_m=locations_m,
        headings_deg=headings_deg,
        graph=recorded_pose_graph(locations_m, headings_deg, step_m, source=name),
        made_by=Provenance(SOURCE, room=name, versions={"clearway": __version__, "ai2thor": version("ai2thor")}),
        cell_size_m=step_m,
    )
    check_scene(scene)
    return scene


def _reachable(controller: Controller, name: str) -> list[dict[str, float]]:
    event = controller.step(action="GetReachablePositions")
    if not event.metadata["lastActionSuccess"]:
        raise SceneError(name, f"its positions cannot be had ({event.metadata['errorMessage']})", TRY_ANOTHER)
    positions = event.metadata["actionReturn"]
    most = MAX_STATES // len(HEADINGS_DEG)
    if not positions or len(positions) > most:
        problem = f"the simulator names {len(positions or ())} reachable positions, expected 1 to {most}"
        raise SceneError(name, problem, "Give another step")
    height_px, width_px = event.metadata["screenHeight"], event.metadata["screenWidth"]
    check_picture_size(name, height_px, width_px)
    check_picture_count(name, len(positions) * len(HEADINGS_DEG), height_px, width_px, "Give a larger step")
    return sorted(positions, key=lambda position: (position["x"], position["z"]))


def _all_round(controller: Controller, position: dict[str, float]) -> list[np.ndarray] | None:
    """A picture for each heading; None where the agent cannot be put there."""
    frames = []
    for heading_deg in HEADINGS_DEG:
        rotation = {"x": 0.0, "y": float(heading_deg), "z": 0.0}
        event = controller.step(
            action="TeleportFull", **position, rotation=rotation, horizon=0.0, standing=True, forceAction=False
        )
        if not (event.metadata["lastActionSuccess"] and _stands(event.metadata["agent"], position, heading_deg)):
            return None
        frames.append(np.ascontiguousarray(event.frame[..., :3], np.uint8))
    return frames


def _stands(agent: Any, position: dict[str, float], heading_deg: int) -> bool:
    """The agent is where it was put, and looks level along the heading."""
    off_m = max(abs(agent["position"][axis] - position[axis]) for axis in ("x", "z"))
    off_deg = abs((agent["rotation"]["y"] - heading_deg + 180) % 360 - 180)
    return off_m <= OFF_M and max(off_deg, abs(agent["cameraHorizon"])) <= OFF_DEG
