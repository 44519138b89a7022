"""`depth-grid`: features of depth without a network, the mean logarithm of depth in each cell of a grid over the view.

Needs scenes with depth (`--sensors rgb depth`). Nothing is fitted: features are the same function of depth in all
scenes, for any picture size. The logarithm tells near apart finely, where the agent bumps into things, and far
coarsely.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.errors import EncoderError
from clearway.perception.encoder import SENSOR, identity_of
from clearway.scenes.scene import EncoderRecord
from clearway.scenes.sensors import DEPTH

NAME = KIND = "depth-grid"
ROWS, COLUMNS = 9, 12
NEAR_M = 0.1  # what is nearer counts as this near; depth 0 has no logarithm


@dataclass(frozen=True)
class DepthGrid:
    """The encoder.

    Attributes:
        record: what it is.
        rows: cells of the grid from top to bottom.
        columns: cells from left to right.
    """

    record: EncoderRecord
    rows: int
    columns: int

    @property
    def feature_count(self) -> int:
        """F, rows times columns."""
        return self.rows * self.columns

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of depth (B, height, width) float32 metres, cell by cell from the upper left.

        A feature is the mean of log(max(depth, 0.1 m)) over a cell.

        Raises:
            EncoderError: the pictures are no depth, or have fewer pixels than the grid has cells.
        """
        if pictures.ndim != 3 or pictures.dtype != np.float32:
            problem = f"encoder {self.record.name} takes depth, float32 (count, height, width) in metres"
            raise EncoderError(f"{problem}, found {pictures.dtype} {pictures.shape}. Give it a depth camera's pictures")
        count, height, width = pictures.shape
        if height < self.rows or width < self.columns:
            problem = f"encoder {self.record.name} needs pictures of at least {self.columns} x {self.rows} pixels"
            raise EncoderError(f"{problem}, found {width} x {height}. Render larger ones")
        logarithms = np.log(np.maximum(pictures, np.float32(NEAR_M)))
        top, left = np.arange(self.rows) * height // self.rows, np.arange(self.columns) * width // self.columns
        sums = np.add.reduceat(np.add.reduceat(logarithms, top, axis=1), left, axis=2)
        pixels = np.outer(np.diff([*top, height]), np.diff([*left, width]))
        return (sums / pixels).reshape(count, -1).astype(np.float32)


def find_record() -> EncoderRecord:
    """The record of the encoder; there is one."""
    settings = {"kind": KIND, SENSOR: DEPTH, "rows": ROWS, "columns": COLUMNS, "near_m": NEAR_M}
    return EncoderRecord(NAME, identity_of(settings, ()), settings)


def from_record(record: EncoderRecord) -> DepthGrid:
    """The encoder that a record describes. Raises EncoderError where the record was altered."""
    if dict(record.settings) != dict(find_record().settings):
        raise EncoderError(f"encoder {record.name}: its record was altered. Encode the scene again")
    return DepthGrid(record, ROWS, COLUMNS)
