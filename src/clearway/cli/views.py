"""`clearway scenes views`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from clearway.choices import SensorName
from clearway.cli.console import say_made


@dataclass(frozen=True)
class TakeViews:
    """Take pictures of rooms from random free poses, several of each pose, perturbed, for what learns to see.

    What is in the folder already is checked and not made again, so that an interrupted command goes on.

    Example: clearway scenes views rooms --poses 400 --perturb all --sensors rgb depth --out views
    """

    scenes: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Scene files of generated rooms, of floor plans or of our own rooms, or folders of them."""
    out: Path
    """Folder for the views, a file a room."""
    poses: int = 400
    """Of each room: anywhere the body touches nothing, looking anywhere."""
    takes: int | None = None
    """Pictures of each pose, each perturbed in its own way; by default 2, and 1 with --perturb none."""
    perturb: tuple[str, ...] = ("geometry",)
    """all; geometry: all but light and pixel-noise, which can be added to the pictures later; none; names of
    perturbations as of evaluate --live, at full strength; or NAME=STRENGTH. A later word changes an earlier one."""
    sensors: tuple[SensorName, ...] = ("rgb",)
    """What takes the pictures: rgb, or rgb depth (metres, kept in the file beside the colour pictures)."""
    size: tuple[int, int] = (96, 128)
    """Height and width of the pictures, pixels."""
    seed: int = 0
    """Another one gives other poses and perturbations."""
    held_out: bool = False
    """Poses at held-out cells alone, for evaluation; without it, at all others."""
    scene_headings: bool = False
    """Look along the scene's own headings alone."""
    compress: bool = False
    """Files of half the size, which are read at some quarter of the speed."""
    workers: int | None = None
    """Processes, each of which does whole rooms; by default one a core."""
    ray: str | None = None
    """Take them on a Ray cluster: local, auto or an address. Its nodes must see all files under the same paths."""

    def run(self) -> None:
        """Check, take and write."""
        from clearway.api.views import take_views
        from clearway.cli.arguments import check_named

        check_named("scene", self.scenes)
        there = set(self.out.glob("*.h5")) if self.out.is_dir() else set()
        paths = take_views(
            self.scenes,
            out=self.out,
            poses=self.poses,
            takes=self.takes,
            perturb=self.perturb,
            sensors=self.sensors,
            size=self.size,
            seed=self.seed,
            held_out=self.held_out,
            scene_headings=self.scene_headings,
            compress=self.compress,
            workers=self.workers,
            ray=self.ray,
            show_progress=True,
        )
        say_made(self.out, paths, there)
