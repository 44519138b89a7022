"""Checked reading of HDF5 files that others made: every fault of a file leaves as one `SceneError`.

A reader opens a file with `opened` and touches it through the accessors here alone. They follow no link out
of the file, read no size before it is checked against a limit, and turn the library's many exceptions into one.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import EllipsisType

import h5py
import numpy as np

from clearway.errors import SceneError, reason_of
from clearway.files import parse_json, written_whole
from clearway.remote.address import is_fetched
from clearway.remote.passing import TRIES, name_of_present
from clearway.scenes.memory_limits import COPIES, MOST_BYTES, array_limit
from clearway.scenes.storage import check_storage, check_unpacking, check_written

HDF5_VERSION = ("v110", "v110")  # before 1.10 (2016) the index of chunks has no checksum: damage there went unnoticed
MAX_ARRAY_BYTES = MOST_BYTES // COPIES  # of the largest array, in the largest file
MAX_JSON_BYTES = 4 * 1024**2
MAX_GROUP_ARRAYS = 1000
MAKE_AGAIN = "Make the file again or get another copy"

Selection = int | slice | EllipsisType | np.ndarray | tuple[int | slice, ...]
"""Of a dataset's values, as NumPy selects."""

_FAULTS = (
    OSError,
    RuntimeError,
    LookupError,
    ValueError,
    TypeError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    zlib.error,
)


@contextmanager
def faults_named(source: Path, dataset: str = "", problem: str = "cannot be read") -> Iterator[None]:
    """Turn whatever the HDF5 library raises within into a `SceneError` about `source` and `dataset`."""
    try:
        yield
    except _FAULTS as fault:
        raise SceneError(source, f"{problem} ({reason_of(fault)})", MAKE_AGAIN, dataset) from fault


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The HDF5 file at `path`, open for reading; one from elsewhere that has gone from the cache comes again.

    Raises:
        SceneError: it is missing or not HDF5.
        ClearwayError: it cannot be had again.
    """
    if path.is_dir():
        raise SceneError(path, "is a folder", "Name a scene file in it")
    if not is_fetched(path) and not path.exists():
        raise SceneError(path, "there is no such file", "Check the path")
    with faults_named(path, problem="cannot be opened as HDF5"):
        file = _opened(path)
    try:
        yield file
    finally:
        with faults_named(path, problem="cannot be closed"):
            file.close()


def _opened(path: Path) -> h5py.File:
    """The file; the library asks for its place on the disk, so one that goes while it is opened is opened again."""
    for left in reversed(range(TRIES)):
        with name_of_present(path) as name:
            try:
                return h5py.File(name, "r")
            except OSError as fault:
                if left and is_fetched(path) and not path.exists():
                    continue
                if not h5py.is_hdf5(name):
                    problem = "is not an HDF5 file"
                    raise SceneError(path, problem, "Give a scene file in the thor_v1 format") from fault
                raise
    raise AssertionError("the last try ends above")


@contextmanager
def written(path: Path, libver: tuple[str, str] = HDF5_VERSION) -> Iterator[h5py.File]:
    """A new HDF5 file for `path`, written whole or not at all. Raises SceneError where it cannot be written."""
    try:
        with written_whole(path) as part, h5py.File(part, "w", libver=libver) as file:
            yield file
    except (OSError, RuntimeError) as fault:  # HDF5 raises the second where the disk fills up as a file is closed
        problem = f"cannot be written ({reason_of(fault)})"
        raise SceneError(path, problem, "Check that the folder may be written to and has room") from fault


def find_dataset(parent: h5py.Group, name: str, source: Path) -> h5py.Dataset | None:
    """The dataset `name` of a file or group, or None where there is none.

    Raises:
        SceneError: it is a link, not a dataset, keeps its values in another file, or is packed in an unknown way.
    """
    with faults_named(source, name):
        if not parent.id.links.exists(name.encode()):
            return None
        if parent.id.links.get_info(name.encode()).type != h5py.h5l.TYPE_HARD:
            raise SceneError(source, "is a link, which is not followed", "Copy the data into the file", name)
        opened_id = h5py.h5o.open(parent.id, name.encode())
        if not isinstance(opened_id, h5py.h5d.DatasetID):
            raise SceneError(source, "is not a dataset", MAKE_AGAIN, name)
        found = h5py.Dataset(opened_id, readonly=True)
        check_storage(found, source, name)
        return found


def need_dataset(parent: h5py.Group, name: str, source: Path) -> h5py.Dataset:
    """The dataset `name`, which the format requires. Raises SceneError where it is missing or unusable."""
    found = find_dataset(parent, name, source)
    if found is None:
        raise SceneError(source, "is missing", "Give a complete scene file in the thor_v1 format", name)
    return found


def check_layout(
    dataset: h5py.Dataset, source: Path, *, shape: tuple[int | None, ...], kinds: str, limit: int | None = None
) -> None:
    """Check rank, lengths, number type and size of a dataset before anything of it is read.

    Args:
        dataset: the dataset.
        source: the file, for the error.
        shape: expected length of each axis; None where any length will do.
        kinds: letters of `numpy.dtype.kind` that are accepted, for example "iuf".
        limit: most bytes that the whole dataset may hold; None where it is read piece by piece.

    Raises:
        SceneError: something differs.
    """
    name = _short_name(dataset)
    with faults_named(source, name):
        found, dtype = dataset.shape, dataset.dtype
    if found is None or not _shape_fits(found, shape):
        wanted = ", ".join("any" if length is None else str(length) for length in shape)
        raise SceneError(source, f"has shape {found}, expected ({wanted})", MAKE_AGAIN, name)
    if dtype.kind not in kinds or dtype.names or dtype.subdtype:
        raise SceneError(source, f"holds {str(dtype)[:80]}, expected numbers of kind '{kinds}'", MAKE_AGAIN, name)
    if limit is not None and math.prod(found) * dtype.itemsize > limit:
        problem = f"would take {math.prod(found) * dtype.itemsize:,} bytes, more than the limit of {limit:,}"
        raise SceneError(source, problem, "Give a smaller scene", name)


def _shape_fits(found: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(found) == len(wanted) and all(w is None or f == w for f, w in zip(found, wanted, strict=True))


def _short_name(dataset: h5py.Dataset) -> str:
    return str(dataset.name or "").lstrip("/")


def read_values(dataset: h5py.Dataset, source: Path, selection: Selection = ...) -> np.ndarray:
    """The values of a dataset or of a part of it.

    Raises:
        SceneError: they are too many for a file of its size, were never written, or are damaged (a checksum fails).
    """
    name = _short_name(dataset)
    with faults_named(source, name, "is damaged"):
        rows, count = _selected(dataset.shape, selection)
        size, limit = count * dataset.dtype.itemsize, array_limit(source)
        if size > limit:
            problem = f"would take {size:,} bytes, more than the limit of {limit:,} for a file of its size"
            raise SceneError(source, problem, "Give a smaller scene", name)
        check_written(dataset)
        check_unpacking(dataset, rows)
        if selection is not ... or not dataset.shape:
            return np.asarray(dataset[selection])
        values = np.empty(dataset.shape, dataset.dtype)
        dataset.id.read(h5py.h5s.ALL, h5py.h5s.ALL, values)  # as h5py does, which looks at the selection at length
    return values


def _selected(shape: tuple[int, ...], selection: Selection) -> tuple[np.ndarray, int]:
    """The indices along the first axis that a selection has, (R,), and how many values it has in all."""
    if not shape:
        return np.zeros(0, np.int64), 1
    if selection is ...:
        return np.arange(shape[0]), math.prod(shape)
    first, *others = selection if isinstance(selection, tuple) else (selection,)
    rows = np.atleast_1d(np.arange(shape[0])[first])
    kept = [np.arange(length)[part].size for length, part in zip(shape[1:], others, strict=False)]
    return rows, len(rows) * math.prod(kept) * math.prod(shape[1 + len(kept) :])


def read_attribute(item: h5py.Group | h5py.Dataset, name: str, source: Path) -> str | int | float | None:
    """A small attribute as a Python number or text, None where there is none."""
    with faults_named(source, problem=f"attribute '{name}' cannot be read"):
        if not h5py.h5a.exists(item.id, name.encode()):
            return None
        kept = h5py.h5a.open(item.id, name.encode())
        dtype = kept.dtype
        if kept.shape != () or dtype.kind not in "iufbSO":
            raise SceneError(source, f"attribute '{name}' is neither a number nor a text", MAKE_AGAIN)
        if kept.get_storage_size() > MAX_JSON_BYTES:
            raise SceneError(source, f"attribute '{name}' is too large", MAKE_AGAIN)
        value = item.attrs[name] if dtype.kind == "O" else _read_scalar(kept, dtype)
        value = value.item() if isinstance(value, np.generic) else value
        value = value.decode() if isinstance(value, bytes) else value
    if not isinstance(value, str | int | float) or (isinstance(value, str) and len(value) > MAX_JSON_BYTES):
        raise SceneError(source, f"attribute '{name}' is neither a number nor a text", MAKE_AGAIN)
    return value


def _read_scalar(kept: h5py.h5a.AttrID, dtype: np.dtype) -> int | float | bytes:
    """The value of an attribute of fixed size."""
    value = np.zeros((), dtype)
    kept.read(value)
    return value.item()


def read_number(item: h5py.Group | h5py.Dataset, name: str, source: Path, low: float, high: float) -> float | None:
    """A finite number attribute between `low` and `high`, None where there is none."""
    value = read_attribute(item, name, source)
    if value is None:
        return None
    if isinstance(value, str) or not low <= value <= high:  # NaN fails the comparison
        raise SceneError(source, f"attribute '{name}' is {value!r}, expected {low} to {high}", MAKE_AGAIN)
    return float(value)


def read_record(item: h5py.Group | h5py.Dataset, name: str, source: Path) -> dict[str, object] | None:
    """An attribute that holds one JSON object, None where there is none."""
    text = read_attribute(item, name, source)
    if text is None:
        return None
    try:
        record = parse_json(str(text))
    except ValueError as fault:
        raise SceneError(source, f"attribute '{name}' is not JSON ({fault})", MAKE_AGAIN) from fault
    if not isinstance(record, dict):
        raise SceneError(source, f"attribute '{name}' is not a JSON object", MAKE_AGAIN)
    return record


def read_group_arrays(file: h5py.File, name: str, source: Path) -> dict[str, np.ndarray]:
    """The numeric arrays of a group by name; empty where there is no such group."""
    arrays, left = {}, array_limit(source)
    for key, dataset in group_datasets(file, name, source).items():
        with faults_named(source, f"{name}/{key}"):
            anything = (None,) * len(dataset.shape or ())
        check_layout(dataset, source, shape=anything, kinds="iufb", limit=left)
        arrays[key] = read_values(dataset, source)
        left -= arrays[key].nbytes
    return arrays


def group_datasets(file: h5py.File, name: str, source: Path) -> dict[str, h5py.Dataset]:
    """The datasets of a group by name, as `find_dataset` checks them; empty where there is no such group."""
    with faults_named(source, name):
        link = file.get(name, getlink=True)
        if link is None:
            return {}
        group = file[name] if isinstance(link, h5py.HardLink) else None
        if not isinstance(group, h5py.Group) or len(group) > MAX_GROUP_ARRAYS:
            raise SceneError(source, f"is not a group of at most {MAX_GROUP_ARRAYS} arrays", MAKE_AGAIN, name)
        keys = [str(key) for key in group]
    return {key: need_dataset(group, key, source) for key in keys}


def write_text(item: h5py.Group | h5py.Dataset, name: str, text: str) -> None:
    """Store a text as an attribute of fixed length, which HDF5 keeps under a checksum, unlike one of any length."""
    item.attrs[name] = np.bytes_(text.encode())


def write_array(
    parent: h5py.Group,
    name: str,
    values: np.ndarray,
    *,
    chunks: tuple[int, ...] | bool = True,
    gzip_level: int = 4,
) -> h5py.Dataset:
    """Store an array compressed and with a checksum.

    HDF5 offers checksums for neither scalars nor empty arrays: they stand in the dataset's header, which has one.
    """
    if values.size == 0 or values.ndim == 0:
        return _written_in_header(parent, name, values)
    packing = {"compression": "gzip", "compression_opts": gzip_level, "fletcher32": True}
    return parent.create_dataset(name, data=values, chunks=chunks, shuffle=values.itemsize > 1, **packing)


def _written_in_header(parent: h5py.Group, name: str, values: np.ndarray) -> h5py.Dataset:
    """Store a small array in its dataset's header. `create_dataset` would keep a scalar outside, unchecked."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.COMPACT)
    space = h5py.h5s.create_simple(values.shape) if values.ndim else h5py.h5s.create(h5py.h5s.SCALAR)
    kind = h5py.h5t.py_create(values.dtype, logical=True)
    dataset = h5py.Dataset(h5py.h5d.create(parent.id, name.encode(), kind, space, plan))
    if values.size:
        dataset[...] = values
    return dataset
