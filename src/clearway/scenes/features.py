"""Features of a scene file: found and checked, read at once, or left in the file until they are looked at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from clearway.errors import SceneError
from clearway.scenes import hdf5
from clearway.scenes.file_pictures import file_stamp
from clearway.scenes.validate import MAX_FEATURES, check_features

DATASET = "resnet_feature"


@dataclass(frozen=True)
class FileFeatures:
    """Features (S, F) in a scene file, read and checked whenever they become an array.

    Like `FilePictures` it keeps no file open, and refuses one that was replaced.

    Attributes:
        path: the file.
        shape: (S, F).
        stamp: what the file was like when the scene was read, see `file_stamp`.
    """

    path: Path
    shape: tuple[int, ...]
    stamp: tuple[int | str, ...]

    @property
    def dtype(self) -> np.dtype:
        """float32, whatever the file has."""
        return np.dtype(np.float32)

    def __array__(self, dtype: np.dtype | None = None, /, *, copy: bool | None = None) -> np.ndarray:
        """All features, (S, F) float32 or as asked for.

        Raises:
            SceneError: the file is gone, damaged, or another than when the scene was read, or a feature is NaN or Inf.
        """
        if file_stamp(self.path) != self.stamp:
            raise SceneError(self.path, "has changed since the scene was read", "Read the scene again")
        with hdf5.opened(self.path) as file:
            dataset = find_features(file, self.path, self.shape[0])
            assert dataset is not None, "the stamp says that nothing has changed"
            features = read_features(dataset, self.path)
        check_features(features, self.shape[0], self.path)
        return features if dtype is None else features.astype(dtype, copy=False)


def find_features(file: h5py.File, path: Path, count: int) -> h5py.Dataset | None:
    """The features of `count` states in an open file, their layout checked; None where it has none.

    Raises:
        SceneError: their shape, type or size is not acceptable.
    """
    dataset = hdf5.find_dataset(file, DATASET, path)
    if dataset is None:
        return None
    shape = (count, None) if len(dataset.shape or ()) == 2 else (count, None, None)
    hdf5.check_layout(dataset, path, shape=shape, kinds="f")
    if 0 in dataset.shape or dataset.shape[-1] > MAX_FEATURES:
        problem = f"has shape {dataset.shape}, expected 1 to {MAX_FEATURES} features"
        raise SceneError(path, problem, hdf5.MAKE_AGAIN, DATASET)
    return dataset


def read_features(dataset: h5py.Dataset, path: Path) -> np.ndarray:
    """Features (S, F) float32, index 0 of the second axis where there are three. Raises SceneError for damage."""
    count, *takes, width = dataset.shape
    if takes in ([], [1]):
        values = hdf5.read_values(dataset, path).reshape(count, width)
    else:
        values = hdf5.read_values(dataset, path, np.s_[:, 0])
    with np.errstate(over="ignore"):  # a float64 beyond float32 becomes Inf, which `check_features` names
        return np.ascontiguousarray(values, dtype=np.float32)
