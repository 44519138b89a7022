"""`FilePictures`: the pictures of a scene file, read when they are looked at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearway.errors import SceneError
from clearway.remote.address import COPIED_NS, is_fetched
from clearway.scenes.hdf5 import check_layout, need_dataset, opened, read_values

BLOCK_PICTURES = 64  # pictures that walk through memory together when all of them are read


@dataclass(frozen=True)
class FilePictures:
    """Pictures (S, height, width, 3) uint8 in an HDF5 dataset, or what another sensor saw.

    Index with an int, a slice or an int array.

    No file stays open: each look opens it (about a millisecond), so that the object may be pickled, shared
    between threads and forked processes, and the file replaced. Pictures of a replaced file are refused.

    Attributes:
        path: the file.
        dataset: name of the dataset in it.
        shape: (S, height, width, 3), or (S, ...) of another sensor.
        stamp: what the file was like when the scene was read, see `file_stamp`.
        dtype: of the values.
    """

    path: Path
    dataset: str
    shape: tuple[int, ...]
    stamp: tuple[int | str, ...]
    dtype: str = "uint8"

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        """The pictures asked for, in the order asked for.

        Raises:
            SceneError: the file is gone, damaged, or another than when the scene was read.
            IndexError: an index beyond the last picture.
        """
        wanted = np.arange(self.shape[0])[index]
        if file_stamp(self.path) != self.stamp:
            raise SceneError(self.path, "has changed since the scene was read", "Read the scene again")
        with opened(self.path) as file:
            dataset = need_dataset(file, self.dataset, self.path)
            check_layout(dataset, self.path, shape=self.shape, kinds=np.dtype(self.dtype).kind)
            if wanted.ndim == 0:
                return read_values(dataset, self.path, int(wanted))
            if wanted.size == 0:
                return np.empty((*wanted.shape, *self.shape[1:]), self.dtype)
            ascending, place = np.unique(wanted, return_inverse=True)
            values = read_values(dataset, self.path, _runs(ascending))
            in_order = np.array_equal(ascending, wanted)  # nothing to sort, so nothing to copy
            return values if in_order else values[place.reshape(wanted.shape)]


def _runs(ascending: np.ndarray) -> slice | np.ndarray:
    """A slice where the indices follow each other, which HDF5 reads faster than a list."""
    first, last = int(ascending[0]), int(ascending[-1])
    return slice(first, last + 1) if last - first + 1 == len(ascending) else ascending


def file_stamp(path: Path) -> tuple[int | str, ...]:
    """Device, inode, size and time of change: differs once a file is replaced or written to; () if it is gone.

    Of a file that was fetched, its entry in the cache and the time: it may go and come again, and is the same one.
    """
    fetched = is_fetched(path)
    try:
        status = path.stat()
    except OSError:
        return (path.parent.name, COPIED_NS) if fetched else ()
    if fetched:
        return (path.parent.name, status.st_mtime_ns)
    return (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
