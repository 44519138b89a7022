"""The user's cache of built scenes: each room is built once, whoever asks for it and however often."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Protocol

from clearway import files, rooms
from clearway.errors import SceneError
from clearway.rooms import build as building
from clearway.rooms.build import PICTURE_SIZE_PX, build_floor_plan, build_scene, scene_name, shaping_versions
from clearway.scenes import floor_plans, grid, plan_scenes
from clearway.scenes import sensors as sensing
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB
from clearway.scenes.thor_v1 import read_scene, write_scene

KEY_LENGTH = 16


class Builder(Protocol):
    """What makes a scene that is not in the cache: `build_scene`, or a stand-in."""

    def __call__(
        self, name: str, seed: int, *, sensors: Sequence[str], workers: int | None, ray: str | None, progress: bool
    ) -> Scene:
        """The scene of a room."""


def cached_room_scene(
    name: str,
    seed: int = 0,
    *,
    sensors: Sequence[str] = (RGB,),
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
    build: Builder = build_scene,
) -> Scene:
    """A room's scene from the user's cache; built and kept there the first time.

    Whoever asks for a scene that another process is building waits for it. A builder that is killed leaves no
    scene behind, and a file that cannot be read is built again. The scene's pictures are read from the file on
    demand; it has no features.

    Args:
        name: of the room, one of `clearway.rooms.ROOM_NAMES`.
        seed: 0 is the default room.
        sensors: what takes the pictures, names of `clearway.scenes.sensors.SENSORS`; "rgb" among them.
        workers: number of renderer processes; None: one a core.
        ray: a Ray cluster that renders instead, see `ray_cluster.connected`.
        progress: show what is going on, if standard error is a terminal.
        build: makes the scene.

    Raises:
        SceneError: there is no such room or sensor, or the agent fits nowhere in it.
        RenderError: MuJoCo cannot render on this machine.
    """
    make = partial(build, name, seed, sensors=sensors, workers=workers, ray=ray, progress=progress)
    return _cached(scene_path(name, seed, sensors), scene_name(name, seed), make)


def cached_plan_scene(
    plan: FloorPlan,
    seed: int = 0,
    *,
    sensors: Sequence[str] = (RGB,),
    size_px: tuple[int, int] = PICTURE_SIZE_PX,
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
) -> Scene:
    """A floor plan's furnished room from the user's cache, kept like those of `cached_room_scene`.

    Args and errors: those of `build_floor_plan`.
    """
    make = partial(
        build_floor_plan, plan, seed, sensors=sensors, size_px=size_px, workers=workers, ray=ray, progress=progress
    )
    return _cached(plan_path(plan, seed, sensors, size_px), plan.name, make)


def scene_path(name: str, seed: int, sensors: Sequence[str] = (RGB,)) -> Path:
    """Where the cache keeps the scene of a room as some sensors see it."""
    return _path_of(scene_name(name, seed), {"room": name, "seed": seed, "sensors": sorted(sensors)})


def plan_path(
    plan: FloorPlan, seed: int, sensors: Sequence[str] = (RGB,), size_px: tuple[int, int] = PICTURE_SIZE_PX
) -> Path:
    """Where the cache keeps the furnished room of a floor plan as some sensors see it."""
    shape = {
        "cells": plan.cells.tolist(),
        "blocked": plan.blocked_edges.tolist(),
        "cell_size_m": plan.cell_size_m,
        "walls": plan.walls.tolist(),
        "doors": plan.doors.tolist(),
        "areas": [asdict(area) for area in plan.areas],
        "furniture": [asdict(piece) for piece in plan.furniture],
    }
    asked = {"plan": plan.name, "seed": seed, "sensors": sorted(sensors), "size_px": size_px}
    return _path_of(plan.name, {**asked, **shape})


def _path_of(title: str, shaped_by: Mapping[str, object]) -> Path:
    """A file whose name holds a hash of all that shapes the pictures: what was asked for, and what makes it."""
    all_of_it = {**shaped_by, "versions": shaping_versions(), "sources": sources_hash()}
    key = hashlib.sha256(json.dumps(all_of_it, sort_keys=True).encode()).hexdigest()[:KEY_LENGTH]
    readable = re.sub(r"[^\w-]", "_", title)
    return files.cache_dir() / "scenes" / f"{readable}-{key}.h5"


def _cached(path: Path, title: str, make: Callable[[], Scene]) -> Scene:
    """The scene of a cache file, made and written there by the first process that finds none."""
    scene = _readable_scene(path, title)
    if scene is not None:
        return scene
    with files.locked(path):
        scene = _readable_scene(path, title)
        if scene is not None:
            return scene
        write_scene(make(), path)
    return read_scene(path, name=title)


def sources_hash(*further: ModuleType) -> str:
    """Hash of the source files that build rooms, their graphs and views, so that a change of them makes a new scene.

    Args:
        further: packages whose source files count too.
    """
    digest = hashlib.sha256()
    sources: dict[str, Path] = {}
    for package in (rooms, *further):
        folder = Path(str(package.__file__)).parent
        own = "" if package is rooms else f"{package.__name__}/"
        sources |= {own + source.relative_to(folder).as_posix(): source for source in sorted(folder.rglob("*.py"))}
    others = {
        module.__name__: Path(str(module.__file__)) for module in (building, floor_plans, grid, plan_scenes, sensing)
    }
    for name, source in {**sources, **others}.items():
        content = source.read_bytes()
        digest.update(f"{name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def _readable_scene(path: Path, title: str) -> Scene | None:
    """The scene in a cache file, under its title; None if there is no file or it is damaged."""
    if not path.exists():
        return None
    try:
        return read_scene(path, name=title)
    except SceneError:
        return None
