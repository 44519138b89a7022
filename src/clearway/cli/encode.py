"""`clearway scenes encode`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from clearway.cli.arguments import SCENE_SUFFIXES, check_named, scene_files
from clearway.cli.imports.writing import Encoding, write_and_say
from clearway.errors import ClearwayError


@dataclass(frozen=True)
class EncodeScenes:
    """Give scenes features of their pictures, all by one encoder, so that they can be trained together.

    Example: clearway scenes encode scenes --encoder random-resnet50 --out together
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Scene files, or folders of them, with pictures. Those to be trained together are encoded together."""
    out: Path
    """Folder for the scene files, under the names they have; for a single one also a file in .h5. The files that are
    read may be written over."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Read, encode and write."""
        from clearway.perception import encode_scenes
        from clearway.ray_cluster import kept_connected
        from clearway.scenes.thor_v1 import read_scene

        self.encoding.check()
        check_named("scene file", self.files)
        files = scene_files(self.files)
        paths = self._paths(files)
        workers, ray = self.encoding.workers, self.encoding.ray
        with kept_connected(ray, workers):
            encoded = encode_scenes(
                [read_scene(file) for file in files],
                self.encoding.encoder,
                seed=self.encoding.encoder_seed,
                progress=True,
                workers=workers,
                ray=ray,
            )
        for scene, path in zip(encoded, paths, strict=True):
            write_and_say(scene, path)

    def _paths(self, files: list[Path]) -> list[Path]:
        """Where the scenes are to be written, before the minutes that encoding takes."""
        if self.out.suffix.lower() in SCENE_SUFFIXES and not self.out.is_dir():
            if len(files) > 1:
                raise ClearwayError(f"{self.out}: one file for {len(files)} scenes. Give a folder with --out")
            return [self.out]
        if self.out.exists() and not self.out.is_dir():
            raise ClearwayError(f"{self.out}: a file, but no scene's. Give a folder or a name in .h5 with --out")
        paths = [self.out / file.name for file in files]
        if twice := [path for path in paths if paths.count(path) > 1]:
            raise ClearwayError(f"{twice[0].name}: two files have this name. Encode them into folders of their own")
        return paths
