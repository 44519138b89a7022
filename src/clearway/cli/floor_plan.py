"""`clearway scenes floor-plan`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from clearway.cli.console import stderr_console


@dataclass(frozen=True)
class FromFloorPlan:
    """Make scenes of floor plans: four headings a cell, made-up features, no pictures.

    Example: clearway scenes floor-plan hall.txt --out scenes
    """

    file: Annotated[Path, tyro.conf.Positional]
    """A map seen from above in .txt (# blocked, . reachable) or .csv (0 blocked, 1 reachable), a list of cells in .csv
    (header x,z), or NumPy arrays of cells in .npz, one a plan."""
    out: Path
    """Folder for the scene files."""
    name: tuple[str, ...] = ()
    """Which plans of a .npz file; by default all."""
    features: int = 2048
    """Features a pose: smooth random functions of it. Scenes of one number and seed can be trained together."""
    seed: int = 0
    """Of the features."""
    cell_size: float = 0.25
    """Side of a cell, metres."""

    def run(self) -> None:
        """Make and write."""
        from clearway.scenes.floor_plan_files import floor_plan_names, read_floor_plan
        from clearway.scenes.floor_plans import floor_plan_scene
        from clearway.scenes.thor_v1 import write_scene

        names = self.name or floor_plan_names(self.file)
        plans = [read_floor_plan(self.file, name, cell_size_m=self.cell_size) for name in names]
        for plan in plans:
            scene = floor_plan_scene(plan, self.features, self.seed)
            path = self.out / f"{scene.name}.h5"
            write_scene(scene, path)
            stderr_console().print(f"{path}: {scene.state_count} states, {scene.cell_count} cells", highlight=False)
