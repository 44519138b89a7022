"""`clearway scenes build|inspect|export`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from clearway.choices import RoomName, SensorName
from clearway.cli.arguments import SCENE_SUFFIXES, check_at_least, check_ending, check_seeds, scene_files
from clearway.cli.console import print_json, say, stdout_console
from clearway.cli.imports.writing import replaces, write_and_say
from clearway.errors import ClearwayError, printable
from clearway.ray_cluster import kept_connected


@dataclass(frozen=True)
class Build:
    """Build furnished rooms: render every view, encode it, write scene files.

    Example: clearway scenes build --room bathroom --out bathroom.h5
    """

    out: Path
    """The scene file to write, .h5 or .hdf5, or a folder for it; for --room all, a folder for the four of them."""
    room: RoomName | Literal["all"] = "all"
    """Which room."""
    seed: int = 0
    """Seed 0 gives the default rooms, another one other colours, textures, pictures and small furniture."""
    sensors: tuple[SensorName, ...] = ("rgb",)
    """What takes the pictures: rgb, or rgb depth (metres, kept in the file beside the colour pictures)."""
    encoder: str = "auto"
    """auto or clearway (the shipped eyes), resnet50 (microsoft/resnet-50), random-resnet50, depth-grid (needs
    --sensors rgb depth), a folder of eyes, one of another package (clearway plugins), or a Hugging Face model."""
    encoder_seed: int = 0
    """Seed of random-resnet50."""
    workers: int | None = None
    """Processes that render, and then encode with one thread each; by default one a core renders, and one encodes with
    as many threads as there are cores."""
    ray: str | None = None
    """Render and encode on a Ray cluster: local, auto or an address."""

    def run(self) -> None:
        """Build and write."""
        from clearway.perception import check_encoder, encode_scenes
        from clearway.rooms import ROOM_NAMES
        from clearway.rooms.library import cached_room_scene
        from clearway.scenes.sensors import check_names

        check_seeds(seed=self.seed, encoder_seed=self.encoder_seed)
        check_at_least(1, workers=self.workers)
        check_names(self.sensors)
        check_encoder(self.encoder, self.sensors)
        in_folder = self.out.is_dir() or self.out.suffix.lower() not in SCENE_SUFFIXES
        if self.room == "all" and not in_folder:
            raise ClearwayError(f"{self.out}: --room all makes four files. Give a folder with --out")
        if in_folder and self.out.exists() and not self.out.is_dir():
            raise ClearwayError(f"{self.out}: a file, but no scene's. Give a folder or a name in .h5 with --out")
        names = ROOM_NAMES if self.room == "all" else (self.room,)
        workers, ray = self.workers, self.ray
        with kept_connected(ray, workers):
            scenes = [
                cached_room_scene(name, self.seed, sensors=self.sensors, workers=workers, ray=ray, progress=True)
                for name in names
            ]
            encoded = encode_scenes(
                scenes, self.encoder, seed=self.encoder_seed, progress=True, workers=workers, ray=ray
            )
        for scene in encoded:
            write_and_say(scene, self.out / f"{scene.name}.h5" if in_folder else self.out)


@dataclass(frozen=True)
class Inspect:
    """Say what a scene file holds, and draw its map; or what views of rooms hold, a file of them or a folder.

    Example: clearway scenes inspect bathroom.h5 --map bathroom.png
    """

    file: Annotated[Path, tyro.conf.Positional]
    """The scene file, or views that clearway scenes views took."""
    map: Path | None = None
    """Write a map with the zones here (PNG)."""
    json: bool = False
    """Print JSON."""

    def run(self) -> None:
        """Print the figures."""
        from clearway.scenes.contents import check_contents
        from clearway.scenes.inspect import summary
        from clearway.scenes.thor_v1 import read_scene
        from clearway.views.shard import is_shard
        from clearway.views.stream import views_in
        from clearway.views.summary import summary as views_summary
        from clearway.zones import scene_zones, zone_counts

        check_ending(".png", map=self.map)
        path, *others = scene_files([self.file])
        if is_shard(path):
            if self.map:
                raise ClearwayError(f"{self.file}: holds views, which have no map. Leave out --map")
            self._print(views_summary(views_in([path, *others])))
            return
        if others:
            raise ClearwayError(f"{self.file}: a folder of {1 + len(others)} scene files. Name one, such as {path}")
        scene = read_scene(path)
        check_contents(scene)
        zones = scene_zones(scene)
        content = {**summary(scene).to_json(), "zones": zone_counts(zones)}
        if self.map:
            from clearway.viz.maps import draw_map

            draw_map(scene, self.map, zones=zones)
        self._print(content)

    def _print(self, content: dict[str, object]) -> None:
        if self.json:
            print_json(content)
        else:
            _print_table(content)


@dataclass(frozen=True)
class Export:
    """Write a scene for other people's loaders.

    Example: clearway scenes export bathroom.h5 --out bathroom_thor.h5
    """

    file: Annotated[Path, tyro.conf.Positional]
    """The scene file."""
    out: Path
    """The file to write."""
    format: Literal["thor-v1"] = "thor-v1"
    """The layout of the published dumps, and nothing else in the file; HDF5 1.8 reads it."""

    def run(self) -> None:
        """Read and write."""
        from clearway.scenes.export import export_thor_v1
        from clearway.scenes.thor_v1 import read_scene

        if self.file.is_dir():
            raise ClearwayError(f"{self.file}: a folder. Name one scene file")
        check_ending(*SCENE_SUFFIXES, out=self.out)
        path, *others = scene_files([self.file])
        if others:
            raise ClearwayError(f"{self.file}: a folder. Name one scene file, such as {path.name}")
        if self.out.resolve() == path.resolve():
            raise ClearwayError(f"{self.out}: would be written over the scene itself. Give another file with --out")
        said = replaces(self.out)
        export_thor_v1(read_scene(path), self.out)
        say(f"{self.out}: in the layout {self.format}{said}")


def _print_table(content: dict[str, object]) -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for key, value in content.items():
        if value is None:
            continue
        name = "picture height, width" if key == "picture_size" else key.replace("_", " ")
        table.add_row(name, Text(printable(_cell(value))))
    stdout_console().print(table)


def _cell(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{k} {_cell(v)}" for k, v in value.items())
    if isinstance(value, tuple | list):
        return ", ".join(map(_cell, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
