"""`clearway scenes import KIND`: scenes from other people's data. docs/scenes.md has a page on each kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.cli.arguments import (
    SCENE_SUFFIXES,
    check_at_least,
    check_finite,
    check_positive,
    check_seeds,
    scene_files,
)
from clearway.cli.console import stderr_console
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.scenes.floor_plans import FloorPlan
    from clearway.scenes.scene import Scene


@dataclass(frozen=True)
class Encoding:
    """How pictures become features."""

    encoder: str = "auto"
    """resnet50, random-resnet50, auto (the first if it can be had, else the second), or a Hugging Face model."""
    encoder_seed: int = 0
    """Seed of random-resnet50."""
    workers: int | None = None
    """Processes that encode, with one thread each; by default one, with as many threads as there are cores."""
    ray: str | None = None
    """Encode on a Ray cluster: local, auto or an address."""


@dataclass(frozen=True)
class ImportDumps:
    """Read thor_v1 dumps, check them, and write them as scene files of our own.

    Example: clearway scenes import thor-v1 dumps/bathroom_02.h5 dumps/kitchen_02.h5 --out scenes
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """thor_v1 HDF5 files, or folders or zip archives of them."""
    out: Path
    """Folder for the scene files."""
    encoder: str | None = None
    """Encode the pictures anew, all files together, with this encoder; by default the files' features stay."""
    encoder_seed: int = 0
    """Seed of random-resnet50."""
    workers: int | None = None
    """Processes that encode, with one thread each; by default one, with as many threads as there are cores."""
    ray: str | None = None
    """Encode on a Ray cluster: local, auto or an address."""

    def run(self) -> None:
        """Import and write."""
        from clearway.scenes.importers.archives import unpacked
        from clearway.scenes.thor_v1 import read_scene

        if self.encoder:
            check_seeds(encoder_seed=self.encoder_seed)
        with unpacked(self.files, SCENE_SUFFIXES) as paths:  # pictures stay in the files until they are written
            files = scene_files(paths)
            scenes = [read_scene(path) for path in files]
            if self.encoder:
                encode_and_write(
                    scenes, self.out, Encoding(self.encoder, self.encoder_seed, self.workers, self.ray), files
                )
            else:
                write_scenes(scenes, self.out, files)


@dataclass(frozen=True)
class ImportFloorPlan:
    """Make furnished rooms of floor plans: blocked cells become furniture and walls, four views a cell are rendered.

    Example: clearway scenes import floor-plan hall.txt --out scenes
    """

    file: Annotated[Path, tyro.conf.Positional]
    """A map seen from above in .txt (# blocked, . reachable) or .csv (0 blocked, 1 reachable), a list of cells in .csv
    (header x,z), or NumPy arrays of cells in .npz, one a plan."""
    out: Path
    """Folder for the scene files."""
    name: tuple[str, ...] = ()
    """Which plans of a .npz file; by default all."""
    features: int | None = None
    """Render nothing, and give each pose so many made-up features, 2048 for example: smooth random functions of it.
    Scenes of one number and seed can be trained together."""
    seed: int = 0
    """With the plan's name: of the furniture, colours and textures, or of the made-up features."""
    cell_size: float = 0.25
    """Side of a cell, metres."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Make and write."""
        from clearway.scenes.floor_plan_files import floor_plan_names, read_floor_plan
        from clearway.scenes.floor_plans import floor_plan_scene

        names = self.name or floor_plan_names(self.file)
        plans = [read_floor_plan(self.file, name, cell_size_m=self.cell_size) for name in names]
        if self.features is None:
            self._render(plans)
            return
        for plan in plans:
            write_scenes([floor_plan_scene(plan, self.features, self.seed)], self.out)

    def _render(self, plans: Sequence[FloorPlan]) -> None:
        """Make rooms, encode their pictures and write."""
        from clearway.scenes.library import cached_plan_scene
        from clearway.scenes.rooms.plans.limits import check_can_be_rendered

        check_seeds(encoder_seed=self.encoding.encoder_seed)
        for plan in plans:  # all of them before anything that takes minutes
            check_can_be_rendered(plan, self.seed)
        scenes = [cached_plan_scene(plan, self.seed, progress=True) for plan in plans]
        encode_and_write(scenes, self.out, self.encoding)


@dataclass(frozen=True)
class ImportImages:
    """Make a scene of photographs and a table that says where each was taken.

    Example: clearway scenes import images office/poses.csv --step 0.5 --out scenes
    """

    table: Annotated[Path, tyro.conf.Positional]
    """CSV file with the columns file, x, z (metres) and heading (degrees, 0 along +z, 90 along +x); files lie beside it
    or in folders beside it. Every location needs the same evenly spaced headings."""
    out: Path
    """Folder for the scene file."""
    step: float = 0.5
    """Length of a move: how far neighbouring locations are apart, metres."""
    blocked: Path | None = None
    """CSV file with the columns x1, z1, x2, z2: pairs of neighbouring locations without a way between them."""
    name: str | None = None
    """Of the scene; by default the table's."""
    height: int = 300
    """Of the scene's pictures, pixels; the width follows from the first photograph, others are cut to fit."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Read, encode and write."""
        from clearway.scenes.importers.images import read_images

        check_at_least(1, height=self.height)
        scene = read_images(self.table, step_m=self.step, blocked=self.blocked, name=self.name, height_px=self.height)
        encode_and_write([scene], self.out, self.encoding)


@dataclass(frozen=True)
class ImportSavn:
    """Make scenes of the offline iTHOR data of SAVN: level camera, four headings.

    Example: clearway scenes import savn data/FloorPlan1_physics --out scenes
    """

    folders: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Folders of one scene each, with graph.json and images.hdf5 or resnet50_fc.hdf5."""
    out: Path
    """Folder for the scene files."""
    step: float = 0.5
    """Length of a move, a multiple of 0.25 m."""
    encoder: str | None = None
    """Encode the pictures anew with this encoder; by default the features of resnet50_fc.hdf5 stay, where they are."""
    encoder_seed: int = 0
    """Seed of random-resnet50."""
    workers: int | None = None
    """Processes that encode, with one thread each; by default one, with as many threads as there are cores."""
    ray: str | None = None
    """Encode on a Ray cluster: local, auto or an address."""

    def run(self) -> None:
        """Read, encode and write."""
        from clearway.scenes.importers.savn import read_savn

        check_seeds(encoder_seed=self.encoder_seed)
        scenes = [read_savn(folder, step_m=self.step) for folder in self.folders]
        featured = all(scene.features is not None for scene in scenes)
        if self.encoder is None and featured:
            write_scenes(scenes, self.out)
        else:
            encode_and_write(
                scenes, self.out, Encoding(self.encoder or "auto", self.encoder_seed, self.workers, self.ray)
            )


@dataclass(frozen=True)
class ImportAvd:
    """Make scenes of the Active Vision Dataset: real homes, twelve headings.

    Example: clearway scenes import avd data/Home_001_1 data/Home_002_1 --out scenes
    """

    folders: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Folders of one scene each, with annotations.json and jpg_rgb."""
    out: Path
    """Folder for the scene files."""
    height: int = 300
    """Of the scene's pictures, pixels; the width follows."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Read, encode and write."""
        from clearway.scenes.importers.avd import read_avd

        check_at_least(1, height=self.height)
        scenes = [read_avd(folder, height_px=self.height) for folder in self.folders]
        encode_and_write(scenes, self.out, self.encoding)


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
        from clearway.scenes.importers.ai2thor import photographed, started

        check_at_least(1, width=self.width, height=self.height)
        check_positive(step=self.step)
        check_seeds(encoder_seed=self.encoding.encoder_seed)  # before anything that takes minutes
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
    """Of the scene; by default the file's."""
    width: int = 400
    """Of the pictures, pixels."""
    height: int = 300
    """Of the pictures, pixels."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Compile, find the free cells, render, encode and write."""
        from clearway.scenes.build import check_mujoco

        check_positive(step=self.step, agent_radius=self.agent_radius, agent_height=self.agent_height)
        check_finite(floor_height=self.floor_height, camera_height=self.camera_height)
        check_seeds(encoder_seed=self.encoding.encoder_seed)
        check_mujoco()
        from clearway.scenes.importers.mjcf import read_mjcf
        from clearway.scenes.importers.mjcf_floor import World
        from clearway.scenes.rooms.obstacles import AgentShape

        scene = read_mjcf(
            self.file,
            World(self.floor_height, self.camera_height, self.spawn, self.extent, self.all_geoms),
            AgentShape(self.agent_radius, self.agent_height, self.step),
            name=self.name,
            height_px=self.height,
            width_px=self.width,
            progress=True,
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
        from clearway.scenes.build import scene_name
        from clearway.scenes.importers.miniworld import photographed, started

        check_positive(step=self.step)
        check_seeds(seed=self.seed, encoder_seed=self.encoding.encoder_seed)
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


@dataclass(frozen=True)
class ImportScenes:
    """Make scene files of dumps, floor plans, photographs or simulators.

    Example: clearway scenes import images office/poses.csv --out scenes
    """

    kind: (
        Annotated[ImportDumps, tyro.conf.subcommand("thor-v1")]
        | Annotated[ImportFloorPlan, tyro.conf.subcommand("floor-plan")]
        | Annotated[ImportImages, tyro.conf.subcommand("images")]
        | Annotated[ImportSavn, tyro.conf.subcommand("savn")]
        | Annotated[ImportAvd, tyro.conf.subcommand("avd")]
        | Annotated[ImportAi2Thor, tyro.conf.subcommand("ai2thor")]
        | Annotated[ImportMjcf, tyro.conf.subcommand("mjcf")]
        | Annotated[ImportMiniWorld, tyro.conf.subcommand("miniworld")]
    )

    def run(self) -> None:
        """Import."""
        self.kind.run()


def encode_and_write(scenes: Sequence[Scene], out: Path, encoding: Encoding, files: Sequence[Path] = ()) -> None:
    """Give scenes features, all by one encoder, and write them into a folder; arguments as of `write_scenes`."""
    from clearway.perception import encode_scenes

    check_seeds(encoder_seed=encoding.encoder_seed)
    check_at_least(1, workers=encoding.workers)
    _paths(scenes, out, files)  # before the minutes that encoding takes
    encoded = encode_scenes(
        scenes,
        encoding.encoder,
        seed=encoding.encoder_seed,
        progress=True,
        workers=encoding.workers,
        ray=encoding.ray,
    )
    write_scenes(encoded, out, files)


def write_scenes(scenes: Sequence[Scene], out: Path, files: Sequence[Path] = ()) -> None:
    """Write each scene into a folder, under its name, and say so.

    Args:
        scenes: to be written.
        out: the folder.
        files: that the scenes were read from, one each, and must not be written over; none where they were not.
    """
    from clearway.scenes.thor_v1 import write_scene

    for scene, path in zip(scenes, _paths(scenes, out, files), strict=True):
        write_scene(scene, path)
        stderr_console().print(f"{path}: {scene.state_count} states, {scene.cell_count} cells", highlight=False)


def _paths(scenes: Sequence[Scene], out: Path, files: Sequence[Path]) -> list[Path]:
    """Where the scenes are to be written, once it is seen that nothing is lost by it and all stay in the folder."""
    names = [scene.name for scene in scenes]
    read = {file.resolve() for file in files}
    paths = [out / f"{name}.h5" for name in names]
    for source, name, path in zip(files or names, names, paths, strict=True):
        if Path(name).name != name:
            raise ClearwayError(f"{name}: a scene's name becomes a file's. Give one without slashes")
        if path.resolve() in read:
            raise ClearwayError(f"{path}: would be written over a file to be imported. Give another folder with --out")
        if names.count(name) > 1:
            raise ClearwayError(f"{source}: another one to be imported has this name. Import them one by one")
    return paths
