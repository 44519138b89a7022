"""`TokenGrid`: the fields that a picture is divided into, and the directions that they look in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class TokenGrid:
    """Tokens of a picture, row by row from the upper left.

    Attributes:
        rows, columns: of tokens.
        vertical_fov_deg: angle of view from the lower to the upper edge of the picture.
        aspect: width of the picture by its height.
    """

    rows: int = 6
    columns: int = 8
    vertical_fov_deg: float = 60.0
    aspect: float = 4 / 3

    @property
    def count(self) -> int:
        """T."""
        return self.rows * self.columns

    @cached_property
    def slopes(self) -> np.ndarray:
        """(T, 2) float64, how far up and how far right the middle of each token looks for a metre ahead."""
        up = (1 - (np.arange(self.rows) + 0.5) / self.rows * 2) * self._edge
        right = ((np.arange(self.columns) + 0.5) / self.columns * 2 - 1) * self._edge * self.aspect
        return np.stack(np.meshgrid(up, right, indexing="ij"), axis=-1).reshape(-1, 2)

    def place(self, up: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row and column of slopes, as numbers with fractions; within 0 and `rows`, 0 and `columns` in the picture."""
        row = (1 - up / self._edge) / 2 * self.rows
        return row, (right / self._edge / self.aspect + 1) / 2 * self.columns

    def middles(self, height_px: int, width_px: int) -> tuple[np.ndarray, np.ndarray]:
        """Pixel rows (rows,) and columns (columns,) of the middles of the tokens."""
        rows = (np.arange(self.rows) + 0.5) / self.rows * height_px
        columns = (np.arange(self.columns) + 0.5) / self.columns * width_px
        return rows.astype(int), columns.astype(int)

    @property
    def _edge(self) -> float:
        """Slope of the upper edge."""
        return float(np.tan(np.radians(self.vertical_fov_deg / 2)))
