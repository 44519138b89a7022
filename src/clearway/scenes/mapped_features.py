"""Features of many scenes in one file that is mapped into memory: who looks at them shares its pages with all others.

Axis letters: S states of a scene, F features.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clearway.regular_files import opened
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene

FLOAT_BYTES = 4


@dataclass(frozen=True)
class MappedFeatures:
    """Features (S, F) float32 of a scene in a file of rows (F,) and nothing else.

    Attributes:
        path: the file.
        first: the scene's first row.
        shape: (S, F).
    """

    path: Path
    first: int
    shape: tuple[int, ...]

    @property
    def dtype(self) -> np.dtype:
        """float32."""
        return np.dtype(np.float32)

    @property
    def offset(self) -> int:
        """Where they begin in the file, bytes."""
        return self.first * self.shape[1] * FLOAT_BYTES

    def __array__(self, dtype: np.dtype | None = None, /, *, copy: bool | None = None) -> np.ndarray:
        """All features, (S, F) float32 or as asked for, to be read alone.

        Pages that could be written to by one process alone would count as memory from the start, whatever is looked at:
        Linux refuses more of them than it has memory, unless told otherwise.

        Raises:
            OSError: the file cannot be mapped.
        """
        with opened(self.path) as file:
            rows = np.memmap(file, np.float32, "r", self.offset, self.shape)
        return rows if dtype is None else rows.astype(dtype, copy=False)


def written_features(given: tuple[Scene, MappedFeatures]) -> str:
    """Read the features of a scene, and write them to where they are to lie.

    Returns:
        The scene's digest, see `scene_digest`.

    Raises:
        SceneError: they are damaged, or the scene's file has changed.
    """
    scene, place = given
    features = np.asarray(scene.features, np.float32)
    with place.path.open("r+b") as file:
        file.seek(place.offset)
        file.write(features.data)
    return scene_digest(replace(scene, features=features))
