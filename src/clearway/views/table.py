"""`ViewTable`: what is known of pictures, a row each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from clearway.perception.around import PLACES_M

DIRECTIONS = ("ahead", "left", "right", "behind")
TURNS_DEG = (0.0, -90.0, 90.0, 180.0)  # of the directions, from the heading
FREE = tuple(f"free_{direction}_m" for direction in DIRECTIONS)
STANDS = tuple(f"stands_{ahead_m:g}_{right_m:g}" for ahead_m, right_m in PLACES_M)
WHOLE = {"pose": "int32", "take": "int32", "arrangement": "int32", "zone": "int8"} | dict.fromkeys(STANDS, "bool")
"""Columns of whole numbers."""
WIDE = {"free_m": FREE, "stands": STANDS}
"""Attributes of several numbers a picture, and the columns that they are kept in."""


@dataclass(frozen=True, eq=False)
class ViewTable:
    """What is known of N pictures.

    Attributes:
        pose: (N,) int32, which pose of the room it was taken at; its takes share it.
        take: (N,) int32, which picture of the pose.
        arrangement: (N,) int32, where the furniture stood: 0 as it was built, else a number of the room's own.
        x_m, z_m: (N,) float64, place of the camera, in the coordinates of the scene.
        heading_deg: (N,) float64 from 0 to 360; 0 looks along z, 90 along x.
        height_m: (N,) float64 of the camera.
        pitch_deg: (N,) float64 of the camera, above 0 it looks up.
        zone: (N,) int8, `zones.Zone` of where the body stands, with the furniture as it stood.
        clearance_m: (N,) float64, from the body to the nearest obstacle, at most `REACH_M`.
        free_m: (N, 4) float64, how far the body could move ahead, to the left, to the right and behind, at most
            `REACH_M`.
        stands: (N, 63) bool, whether the body could stand at each of `PLACES_M`, whatever lies between.
    """

    pose: np.ndarray
    take: np.ndarray
    arrangement: np.ndarray
    x_m: np.ndarray
    z_m: np.ndarray
    heading_deg: np.ndarray
    height_m: np.ndarray
    pitch_deg: np.ndarray
    zone: np.ndarray
    clearance_m: np.ndarray
    free_m: np.ndarray
    stands: np.ndarray

    def __len__(self) -> int:
        """N."""
        return len(self.pose)

    def __getitem__(self, rows: np.ndarray | slice) -> ViewTable:
        """Some rows, in the order asked for."""
        return ViewTable(**{name: values[rows] for name, values in vars(self).items()})

    def to_array(self) -> np.ndarray:
        """(N, len(COLUMNS)) float64."""
        return np.column_stack([getattr(self, field.name) for field in fields(self)]).astype(np.float64)


COLUMNS = tuple(name for field in fields(ViewTable) for name in WIDE.get(field.name, (field.name,)))
"""Of `ViewTable.to_array`."""


def table_of(values: np.ndarray) -> ViewTable:
    """The table that `ViewTable.to_array` made an array of."""
    plain = {name: column.astype(WHOLE.get(name, "float64")) for name, column in zip(COLUMNS, values.T, strict=True)}
    wide = {name: np.column_stack([plain.pop(column) for column in columns]) for name, columns in WIDE.items()}
    return ViewTable(**plain, **wide)


def joined(tables: Sequence[ViewTable]) -> ViewTable:
    """One table below the other."""
    return ViewTable(
        **{field.name: np.concatenate([getattr(table, field.name) for table in tables]) for field in fields(ViewTable)}
    )
