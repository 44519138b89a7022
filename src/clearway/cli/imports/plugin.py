"""`clearway scenes import plugin`: importers of other packages."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from clearway.cli.arguments import check_named
from clearway.cli.imports.writing import Encoding, encode_and_write, write_scenes


@dataclass(frozen=True)
class ImportPlugin:
    """Make scenes by an importer of another package; clearway plugins lists them.

    Example: clearway scenes import plugin my-format data/office.json --out scenes
    """

    name: Annotated[str, tyro.conf.Positional]
    """The importer's name."""
    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """What it reads: files or folders, one or several scenes each."""
    out: Path
    """Folder for the scene files."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Read, encode where the importer leaves that to us, and write."""
        from clearway.importers.plugged import plugged_scenes

        check_named("file", self.files)
        self.encoding.check()
        scenes = plugged_scenes(self.name, self.files)
        encoded = [scene for scene in scenes if scene.features is not None]
        if len(encoded) == len(scenes):
            self.encoding.check_unused(f"{self.name} gives scenes with features. Use another importer")
            write_scenes(scenes, self.out)
        else:
            encode_and_write(scenes, self.out, self.encoding)
