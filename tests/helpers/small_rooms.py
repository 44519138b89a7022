"""Small hand-made rooms for the tests: typed-in boxes on an empty floor, walls with known colours."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco

HEIGHT_M = 2.5


@dataclass
class SmallRoom:
    """An empty room of 2 x 2 m whose grid has its first cell at (0.25, 0.25)."""

    name: str = "small"
    seed: int = 0
    width_m: float = 2.0
    depth_m: float = 2.0
    height_m: float = HEIGHT_M
    grid_origin_m: tuple[float, float] = (0.25, 0.25)
    spec: mujoco.MjSpec = field(default_factory=mujoco.MjSpec)

    def add_box(
        self,
        x_m: tuple[float, float],
        z_m: tuple[float, float],
        height_m: tuple[float, float] = (0.0, HEIGHT_M),
        *,
        group: int = 3,
        rgb: tuple[float, float, float] = (0.9, 0.9, 0.9),
    ) -> SmallRoom:
        """Add a box from its extents along x, z and upwards, each (from, to)."""
        extents = (x_m, z_m, height_m)
        self.spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[(low + high) / 2 for low, high in extents],
            size=[(high - low) / 2 for low, high in extents],
            group=group,
            rgba=[*rgb, 1.0],
        )
        return self
