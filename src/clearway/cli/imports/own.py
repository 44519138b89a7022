"""Kinds of `clearway scenes import` for a place of one's own: floor-plan, images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.choices import SensorName
from clearway.cli.arguments import check_at_least
from clearway.cli.console import say, say_begun
from clearway.cli.imports.writing import Encoding, encode_and_write, place_name, write_scenes
from clearway.errors import ClearwayError
from clearway.ray_cluster import kept_connected

if TYPE_CHECKING:
    from clearway.scenes.floor_plans import FloorPlan

TOLD_PLANS = 10  # names of plans to be rendered, at most


@dataclass(frozen=True)
class ImportFloorPlan:
    """Make furnished rooms of floor plans: blocked cells become furniture and walls, four views a cell are rendered.

    Example: clearway scenes import floor-plan hall.txt --out scenes
    """

    file: Annotated[Path, tyro.conf.Positional]
    """A map seen from above in .txt (# blocked, . reachable, W a wall, D a door in it) or .csv (0 blocked, 1
    reachable), a list of cells in .csv (header x,z), or NumPy arrays of cells in .npz, one a plan."""
    out: Path
    """Folder for the scene files."""
    name: tuple[str, ...] = ()
    """Which plans of a .npz file; by default all."""
    features: int | None = None
    """Render nothing, and give each pose so many made-up features, 2048 for example: smooth random functions of it.
    Scenes of one number and seed can be trained together."""
    seed: int = 0
    """With the plan's name: of the furniture, colours and textures, or of the made-up features."""
    cell_size: float | None = None
    """Side of a cell, metres; by default 0.5, of plans in .npz 0.25, as the published ones have."""
    sensors: tuple[SensorName, ...] = ("rgb",)
    """What takes the pictures: rgb, or rgb depth (metres, kept in the file beside the colour pictures)."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Make and write."""
        from clearway.rooms.plans.cell_map import check_doors
        from clearway.scenes.floor_plan_files import read_floor_plans
        from clearway.scenes.floor_plans import parts_apart
        from clearway.scenes.plan_scenes import floor_plan_scene

        plans = read_floor_plans(self.file, self.name, cell_size_m=self.cell_size)
        if self.features is None:
            self._render(plans)
        else:
            self.encoding.check_unused("--features makes features up. Leave out --features")
            if self.sensors != type(self).sensors:
                raise ClearwayError(
                    "--sensors says what to render, but --features renders nothing. Leave out one of them"
                )
            for plan in plans:
                check_doors(plan)
            for plan in plans:
                write_scenes([floor_plan_scene(plan, self.features, self.seed)], self.out)
        for apart in filter(None, map(parts_apart, plans)):  # last: a refusal is one line
            say(apart)

    def _render(self, plans: Sequence[FloorPlan]) -> None:
        """Make rooms, encode their pictures and write."""
        from clearway.perception import check_encoder
        from clearway.rooms.library import cached_plan_scene
        from clearway.rooms.plans.buildable import check_can_be_rendered
        from clearway.scenes.sensors import check_names

        self.encoding.check()
        check_names(self.sensors)
        check_encoder(self.encoding.encoder, self.sensors)
        for plan in plans:  # all of them before anything that takes minutes
            check_can_be_rendered(plan, self.seed)
        say_begun(f"{self.file}: rendering and encoding {', '.join(plan.name for plan in plans[:TOLD_PLANS])}")
        workers, ray = self.encoding.workers, self.encoding.ray
        with kept_connected(ray, workers):
            scenes = [
                cached_plan_scene(plan, self.seed, sensors=self.sensors, workers=workers, ray=ray, progress=True)
                for plan in plans
            ]
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
    """Of the scene; by default the table's, or its folder's where the table is named poses.csv."""
    height: int = 300
    """Of the scene's pictures, pixels; the width follows from the first photograph, others are cut to fit."""
    encoding: Encoding = field(default_factory=Encoding)

    def run(self) -> None:
        """Read, encode and write."""
        from clearway.importers.images import read_images

        check_at_least(1, height=self.height)
        name = place_name(self.table, self.name)
        scene = read_images(self.table, step_m=self.step, blocked=self.blocked, name=name, height_px=self.height)
        encode_and_write([scene], self.out, self.encoding)
