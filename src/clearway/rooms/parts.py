"""What a room is lit by and made of: lamps, windows, and the visible parts of its furniture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clearway.rooms.meshes import Mesh


@dataclass(frozen=True, eq=False)
class Lamp:
    """A lamp that the baked light comes from.

    Attributes:
        centre_m: (3,) middle of the lamp in the room.
        radius_m: the light leaves from a horizontal circle of this size, which softens shadows.
        colour: (3,) of the light.
        power: brightness; a ceiling lamp has about 1.
    """

    centre_m: np.ndarray
    radius_m: float
    colour: np.ndarray
    power: float


@dataclass(frozen=True, eq=False)
class Window:
    """A window that daylight comes through.

    Attributes:
        centre_m: (3,) middle of the pane.
        normal: (3,) unit vector into the room.
        width_m, height_m: size of the pane.
    """

    centre_m: np.ndarray
    normal: np.ndarray
    width_m: float
    height_m: float

    @cached_property
    def right(self) -> np.ndarray:
        """(3,) unit vector along the sill."""
        return np.cross([0.0, 0.0, 1.0], self.normal)


@dataclass(frozen=True, eq=False)
class Part:
    """A visible part of the furniture, placed in the room.

    Attributes:
        mesh: its shape.
        uvs: (V, 2) texture coordinates in repeats of the material's picture.
        material: name of its material; empty for a piece of wall, which only stops light.
        group: MuJoCo's geom group.
        position_m, rotation: (3,) and (3, 3), from the mesh to the room.
        round: it fills the ellipse within its box rather than all of it.
        casts_shadow: light does not pass.
    """

    mesh: Mesh
    uvs: np.ndarray
    material: str
    group: int
    position_m: np.ndarray
    rotation: np.ndarray
    round: bool
    casts_shadow: bool

    @cached_property
    def centre_m(self) -> np.ndarray:
        """(3,) the middle of its box in the room."""
        return self.position_m + self.rotation @ self.mesh.centre_m

    @cached_property
    def half_extents_m(self) -> np.ndarray:
        """(3,) half the size of its box, along the columns of `rotation`."""
        return self.mesh.half_extents_m
