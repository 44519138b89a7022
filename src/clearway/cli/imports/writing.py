"""What all imports do with their scenes: encode, and write without losing anything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.cli.arguments import check_at_least, check_seeds
from clearway.cli.console import say
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.scenes.scene import Scene

COMMON_STEMS = ("poses", "scene")  # of files that lie in a folder for each place


@dataclass(frozen=True)
class Encoding:
    """How pictures become features."""

    encoder: str = "auto"
    """auto or clearway (the shipped eyes), resnet50 (microsoft/resnet-50), random-resnet50, depth-grid (needs
    --sensors rgb depth), a folder of eyes, one of another package (clearway plugins), or a Hugging Face model."""
    encoder_seed: int = 0
    """Seed of random-resnet50."""
    workers: int | None = None
    """Processes that render, where pictures are rendered, and then encode with one thread each; by default one a core
    renders, and one encodes with as many threads as there are cores."""
    ray: str | None = None
    """Render, where pictures are rendered, and encode on a Ray cluster: local, auto or an address."""

    def check(self) -> None:
        """Check the flags. Raises ClearwayError."""
        check_seeds(encoder_seed=self.encoder_seed)
        check_at_least(1, workers=self.workers)

    def check_unused(self, why: str) -> None:
        """Check that no flag is given where nothing is encoded. Raises ClearwayError, which says why."""
        for field in fields(self):
            if getattr(self, field.name) != field.default:
                flag = f"--{field.name.replace('_', '-')}"
                raise ClearwayError(f"{flag} says how to encode, but {why}, or leave out {flag}")


def encode_and_write(scenes: Sequence[Scene], out: Path, encoding: Encoding, files: Sequence[Path] = ()) -> None:
    """Give scenes features, all by one encoder, and write them into a folder; arguments as of `write_scenes`."""
    from clearway.perception import encode_scenes

    encoding.check()
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
    for scene, path in zip(scenes, _paths(scenes, out, files), strict=True):
        write_and_say(scene, path)


def write_and_say(scene: Scene, path: Path) -> None:
    """Write a scene's file, and say so."""
    from clearway.scenes.thor_v1 import write_scene

    said = replaces(path)
    write_scene(scene, path)
    width_m, depth_m = scene.locations_m.max(axis=0) - scene.locations_m.min(axis=0) + scene.cell_size_m
    cells = f"{scene.cell_count} cells of {scene.cell_size_m:.3g} m, {width_m:.3g} x {depth_m:.3g} m"
    say(f"{path}: {scene.state_count} states, {cells}{said}")


def replaces(path: Path) -> str:
    """The end of a line that says what was written, where a scene's file is there already."""
    return ", replaces the scene that was there" if path.exists() else ""


def place_name(file: Path, given: str | None = None) -> str:
    """Name of the place that a file describes: as given, else the file's stem; its folder's where all files have that.

    Raises:
        SceneError: no scene may be called so.
    """
    from clearway.scenes.parts import check_name

    folder = file.resolve().parent.name if file.stem in COMMON_STEMS else ""
    name = given or folder or file.stem
    check_name(name, file)
    return name


def _paths(scenes: Sequence[Scene], out: Path, files: Sequence[Path]) -> list[Path]:
    """Where the scenes are to be written, once it is seen that nothing is lost by it and all stay in the folder."""
    from clearway.scenes.parts import check_name

    names = [scene.name for scene in scenes]
    read = {file.resolve() for file in files}
    paths = [out / f"{name}.h5" for name in names]
    for source, name, path in zip(files or names, names, paths, strict=True):
        check_name(name, str(source))
        if path.resolve() in read:
            raise ClearwayError(f"{path}: would be written over a file to be imported. Give another folder with --out")
        if names.count(name) > 1:
            raise ClearwayError(f"{source}: another one to be imported has this name. Import them one by one")
    return paths
