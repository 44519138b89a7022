"""Kinds of `clearway scenes import` that photograph simulated places: ai2thor, mjcf, miniworld."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from clearway.choices import SensorName
from clearway.cli.arguments import check_at_least, check_finite, check_named, check_positive, check_seeds
from clearway.cli.imports.writing import Encoding, encode_and_write, place_name
from clearway.ray_cluster import kept_connected


@dataclass(frozen=True)
class ImportAi2Thor:
    """Photograph rooms of AI2-THOR, live through the package ai2thor.

    Example: clearway scenes import ai2thor FloorPlan402 FloorPlan302 --out scenes
    """

    rooms: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Names of rooms in the simulator."""
    out: Path
    """Folder for the scene files."""
    step: float = 0.5
    """Length of a move, metres."""
    width: int = 400
    """Of the pictures, pixels."""
    height: int = 300
    """Of the pictures, pixels."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Photograph, encode and write."""
        from clearway.importers.ai2thor import photographed, started

        check_named("room", self.rooms)
        check_at_least(1, width=self.width, height=self.height)
        check_positive(step=self.step)
        self.encoding.check()  # before anything that takes minutes
        scenes = []
        for name in self.rooms:
            with started(name, self.step, self.width, self.height) as controller:
                scenes.append(photographed(controller, name, step_m=self.step, progress=True))
        encode_and_write(scenes, self.out, self.encoding)


@dataclass(frozen=True)
class ImportMjcf:
    """Make a scene of a MuJoCo model: free cells found by its geometry, pictures by MuJoCo's renderer.

    Example: clearway scenes import mjcf office/scene.xml --spawn 1.0 2.0 --out scenes
    """

    file: Annotated[Path, tyro.conf.Positional]
    """MJCF file (.xml); meshes, textures and included files lie where it says. Its x and y are the floor's x and z."""
    out: Path
    """Folder for the scene file."""
    trust: bool = False
    """The files that it names may lie anywhere; by default in its folder alone."""
    step: float = 0.5
    """Length of a move and side of a cell, metres."""
    spawn: tuple[float, float] | None = None
    """A free place, x and z: the grid runs through it, and what cannot be reached from it is left out. By default the
    grid runs through the model's origin, and the largest connected part stays."""
    extent: tuple[float, float, float, float] | None = None
    """Smallest and largest x, smallest and largest z of the floor, metres; by default what the finite geoms span."""
    floor_height: float = 0.0
    """Of the floor in the model, metres."""
    agent_radius: float = 0.2
    """Of the agent's body, a standing capsule, metres."""
    agent_height: float = 1.5
    """Of the agent's body, metres."""
    camera_height: float = 1.0
    """Of the camera above the floor, metres."""
    all_geoms: bool = False
    """Geoms that collide with nothing (contype and conaffinity 0) block the way too; by default they are only seen."""
    name: str | None = None
    """Of the scene; by default the file's, or its folder's where the file is named scene.xml."""
    width: int = 400
    """Of the pictures, pixels."""
    height: int = 300
    """Of the pictures, pixels."""
    sensors: tuple[SensorName, ...] = ("rgb",)
    """What takes the pictures: rgb, or rgb depth (metres, kept in the file beside the colour pictures)."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Compile, find the free cells, render, encode and write."""
        from clearway.perception import check_encoder
        from clearway.rooms.build import check_mujoco

        check_positive(step=self.step, agent_radius=self.agent_radius, agent_height=self.agent_height)
        check_finite(floor_height=self.floor_height, camera_height=self.camera_height)
        self.encoding.check()
        check_encoder(self.encoding.encoder, self.sensors)
        check_mujoco()
        from clearway.importers.mjcf import read_mjcf
        from clearway.importers.mjcf_floor import FloorChoice
        from clearway.rooms.obstacles import AgentShape

        workers, ray = self.encoding.workers, self.encoding.ray
        with kept_connected(ray, workers):
            scene = read_mjcf(
                self.file,
                FloorChoice(self.floor_height, self.camera_height, self.spawn, self.extent, self.all_geoms),
                AgentShape(self.agent_radius, self.agent_height, self.step),
                name=place_name(self.file, self.name),
                height_px=self.height,
                width_px=self.width,
                sensors=self.sensors,
                workers=workers,
                ray=ray,
                progress=True,
                trust=self.trust,
            )
            encode_and_write([scene], self.out, self.encoding)


@dataclass(frozen=True)
class ImportMiniWorld:
    """Photograph environments of MiniWorld through the package miniworld, without a screen.

    Example: clearway scenes import miniworld MiniWorld-FourRooms-v0 --step 1 --out scenes
    """

    environments: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Names registered with Gymnasium; of a module of your own, module:Name-v0."""
    out: Path
    """Folder for the scene files."""
    step: float = 1.0
    """Length of a move and side of a cell, metres."""
    seed: int = 0
    """Of the worlds: where objects, and walls in mazes, are put."""
    width: int = 400
    """Of the pictures, pixels."""
    height: int = 300
    """Of the pictures, pixels."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Photograph, encode and write."""
        from clearway.importers.miniworld import photographed, started
        from clearway.rooms.build import scene_name

        check_named("environment", self.environments)
        check_positive(step=self.step)
        check_seeds(seed=self.seed)
        self.encoding.check()
        scenes = []
        for environment in self.environments:
            name = scene_name(environment.rpartition(":")[2], self.seed)
            with started(environment, self.seed) as env:
                scene = photographed(
                    env,
                    name,
                    step_m=self.step,
                    seed=self.seed,
                    height_px=self.height,
                    width_px=self.width,
                    progress=True,
                )
            scenes.append(scene)
        encode_and_write(scenes, self.out, self.encoding)
