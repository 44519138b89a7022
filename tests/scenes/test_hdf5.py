"""Arrays of our files stand under a checksum, whatever their size."""

import sys
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes import hdf5
from clearway.scenes.hdf5 import HDF5_VERSION

VALUE = 0x1122334455667788  # bytes that stand nowhere else in a small file


def with_scalar(path: Path) -> bytes:
    with h5py.File(path, "w", libver=HDF5_VERSION) as file:
        hdf5.write_array(file, "count", np.array(VALUE))
    return path.read_bytes()


def read_scalar(path: Path) -> int:
    with hdf5.opened(path) as file:
        return int(hdf5.read_values(hdf5.need_dataset(file, "count", path), path))


@pytest.mark.parametrize("values", [np.array(1.5), np.array(VALUE), np.zeros((0, 3))], ids=["float", "int", "empty"])
def test_small_arrays_come_back_from_their_headers(tmp_path: Path, values: np.ndarray) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", libver=HDF5_VERSION) as file:
        dataset = hdf5.write_array(file, "a", values)
        assert dataset.id.get_create_plist().get_layout() == h5py.h5d.COMPACT
    with h5py.File(path) as file:
        found = file["a"][()]
        assert found.dtype == values.dtype and found.shape == values.shape
        assert np.array_equal(found, values)


def test_no_bit_of_a_scalar_changes_unnoticed(tmp_path: Path) -> None:
    path = tmp_path / "scalar.h5"
    content = with_scalar(path)
    assert read_scalar(path) == VALUE
    first = content.index(VALUE.to_bytes(8, "little"))
    for bit in range(64):
        hurt = bytearray(content)
        hurt[first + bit // 8] ^= 1 << bit % 8
        path.write_bytes(hurt)
        with pytest.raises(SceneError):
            read_scalar(path)


@pytest.mark.parametrize(("size", "refused"), [(80 * 1024**2, True), (None, False)])
def test_a_chunk_that_would_unpack_to_more_than_any_may_is_measured(
    tmp_path: Path, size: int | None, refused: bool
) -> None:
    path, values = tmp_path / "a.h5", np.arange(400, dtype=np.int32).reshape(100, 4)
    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("a", values.shape, values.dtype, chunks=values.shape, compression="gzip")
        dataset.id.write_direct_chunk((0, 0), zlib.compress(bytes(size) if size else values.tobytes()))
    with hdf5.opened(path) as file:
        dataset = hdf5.need_dataset(file, "a", path)
        if refused:
            with pytest.raises(SceneError, match=r"the chunk at \(0, 0\) unpacks to more than its 1,600 bytes"):
                hdf5.read_values(dataset, path)
        else:
            assert np.array_equal(hdf5.read_values(dataset, path), values)


@pytest.mark.parametrize("filters", [("deflate", "lzf"), ("lzf", "deflate"), ("deflate", "shuffle")])
def test_what_is_packed_twice_is_refused_unread(tmp_path: Path, filters: tuple[str, str]) -> None:
    """A zlib stream of some kilobytes in an LZF one would take gigabytes."""
    path, plan = tmp_path / "a.h5", h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((100, 4))
    for name in filters:
        {
            "deflate": lambda: plan.set_deflate(4),
            "lzf": lambda: plan.set_filter(h5py.h5z.FILTER_LZF, h5py.h5z.FLAG_OPTIONAL),
            "shuffle": plan.set_shuffle,
        }[name]()
    with h5py.File(path, "w") as file:
        space = h5py.h5s.create_simple((100, 4))
        h5py.h5d.create(file.id, b"a", h5py.h5t.NATIVE_INT32, space, plan)
        file["a"][...] = np.arange(400, dtype=np.int32).reshape(100, 4)
    with hdf5.opened(path) as file, pytest.raises(SceneError, match="packed in an odd order, or twice"):
        hdf5.read_values(hdf5.need_dataset(file, "a", path), path)


@pytest.mark.skipif(sys.platform != "linux", reason="there alone an open file has a name of its own")
def test_a_file_that_is_replaced_after_the_look_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, open_file = tmp_path / "scene.h5", h5py.File
    with open_file(path, "w") as file:
        file["x"] = 1

    def replaced(name: Path, mode: str) -> h5py.File:
        path.unlink()
        with open_file(path, "w") as file:
            file["x"] = 2
        return open_file(name, mode)

    monkeypatch.setattr(h5py, "File", replaced)
    with pytest.raises(SceneError, match=r"scene\.h5: cannot be opened as HDF5"), hdf5.opened(path):
        pass
