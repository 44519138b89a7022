"""Kinds of `clearway scenes import` that read published data: thor-v1, savn, avd."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from clearway.cli.arguments import (
    SCENE_SUFFIXES,
    check_at_least,
    check_named,
    scene_files,
)
from clearway.cli.imports.writing import Encoding, encode_and_write, write_scenes


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
        from clearway.importers.archives import unpacked
        from clearway.scenes.thor_v1 import read_scene

        encoding = Encoding(self.encoder or "auto", self.encoder_seed, self.workers, self.ray)
        encoding.check()
        if self.encoder is None:
            encoding.check_unused("--encoder is not given: the files' features stay. Add it")
        with unpacked(self.files, SCENE_SUFFIXES) as paths:  # pictures stay in the files until they are written
            files = scene_files(paths)
            scenes = [read_scene(path) for path in files]
            if self.encoder:
                encode_and_write(scenes, self.out, encoding, files)
            else:
                write_scenes(scenes, self.out, files)


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
        from clearway.importers.savn import read_savn

        check_named("folder", self.folders)
        encoding = Encoding(self.encoder or "auto", self.encoder_seed, self.workers, self.ray)
        encoding.check()
        scenes = [read_savn(folder, step_m=self.step) for folder in self.folders]
        featured = all(scene.features is not None for scene in scenes)
        if self.encoder is None and featured:
            encoding.check_unused("--encoder is not given: the data's features stay. Add it")
            write_scenes(scenes, self.out)
        else:
            encode_and_write(scenes, self.out, encoding)


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
        from clearway.importers.avd import read_avd

        check_named("folder", self.folders)
        check_at_least(1, height=self.height)
        scenes = [read_avd(folder, height_px=self.height) for folder in self.folders]
        encode_and_write(scenes, self.out, self.encoding)
