"""`clearway scenes import`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import tyro

from clearway.cli.imports.datasets import ImportAvd, ImportDumps, ImportSavn
from clearway.cli.imports.own import ImportFloorPlan, ImportImages
from clearway.cli.imports.plugin import ImportPlugin
from clearway.cli.imports.simulators import ImportAi2Thor, ImportMiniWorld, ImportMjcf


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
        | Annotated[ImportPlugin, tyro.conf.subcommand("plugin")]
    )

    def run(self) -> None:
        """Import."""
        self.kind.run()
