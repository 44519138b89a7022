"""How an HDF5 dataset is stored, judged before the library unpacks any of it.

HDF5 inflates a chunk to whatever its stream holds, not to the chunk's size: a file of a megabyte can take gigabytes.
So a deflated chunk is measured here first, unless it is too short to hold more than any chunk may.
"""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from clearway.errors import SceneError
from clearway.scenes.memory_limits import MIB

MAX_CHUNK_BYTES = 64 * MIB  # what the library unpacks to reach one element
CHECKSUM_BYTES = 4
MOST_DEFLATED = 1_032  # bytes that come of one, whatever a stream holds (zlib, "Technical details")
LZF = h5py.h5z.FILTER_LZF
FILTERS = {  # an LZF stream unpacks to 88 times its size at most; others could load code or unpack without a bound
    h5py.h5z.FILTER_SHUFFLE: "shuffle",
    h5py.h5z.FILTER_DEFLATE: "gzip",
    LZF: "lzf",
    h5py.h5z.FILTER_FLETCHER32: "fletcher32",
}
STORE_AGAIN = "Store the file again with h5py's compression='gzip', or with none"


def check_storage(dataset: h5py.Dataset, source: Path, name: str) -> None:
    """Check that a dataset keeps its values in its own file, in chunks of sane size, packed in known ways.

    Raises:
        SceneError: it does not.
    """
    plan = dataset.id.get_create_plist()
    layout = plan.get_layout()
    if layout == h5py.h5d.VIRTUAL or plan.get_external_count() > 0:
        raise SceneError(source, "keeps its values in another file", "Copy the data into the file", name)
    if layout != h5py.h5d.CHUNKED:
        return
    chunks = plan.get_chunk()
    if math.prod(chunks) * dataset.dtype.itemsize > MAX_CHUNK_BYTES:
        problem = f"its chunks {chunks} hold more than {MAX_CHUNK_BYTES >> 20} MiB each"
        raise SceneError(source, problem, "Store the file again with smaller chunks", name)
    codes = _filters(plan)
    unknown = [code for code in codes if code not in FILTERS]
    if unknown:
        problem = f"is packed with the filter {unknown[0]}, expected {', '.join(FILTERS.values())}"
        raise SceneError(source, problem, STORE_AGAIN, name)
    packing = [code for code in codes if code != h5py.h5z.FILTER_FLETCHER32]
    packers = packing[1:] if packing[:1] == [h5py.h5z.FILTER_SHUFFLE] else packing
    if len(packers) > 1 or h5py.h5z.FILTER_SHUFFLE in packers:  # what two of them unpack to multiplies
        problem = f"is packed in an odd order, or twice: {', '.join(FILTERS[code] for code in codes)}"
        raise SceneError(source, problem, STORE_AGAIN, name)


def check_written(dataset: h5py.Dataset) -> None:
    """Check that all values of a dataset were ever written. Raises ValueError: the rest would be read as 0."""
    shape, chunks = dataset.shape, dataset.chunks
    if shape is None or 0 in shape:
        return
    if chunks:
        wanted = math.prod(-(-length // step) for length, step in zip(shape, chunks, strict=True))
        whole = dataset.id.get_num_chunks() == wanted
    else:
        whole = dataset.id.get_storage_size() >= math.prod(shape) * dataset.dtype.itemsize
    if not whole:
        raise ValueError(f"not all of its {math.prod(shape):,} values were written")


def check_unpacking(dataset: h5py.Dataset, rows: np.ndarray) -> None:
    """Check that no chunk with one of the rows (R,) unpacks to more than a chunk, where that could be much.

    Raises:
        ValueError: one does.
    """
    plan = dataset.id.get_create_plist()
    codes = _filters(plan) if plan.get_layout() == h5py.h5d.CHUNKED else []
    if h5py.h5z.FILTER_DEFLATE not in codes:
        return
    skipped, chunks = 1 << codes.index(h5py.h5z.FILTER_DEFLATE), plan.get_chunk()
    most = math.prod(chunks) * dataset.dtype.itemsize + CHECKSUM_BYTES
    for offset in _offsets(dataset.shape, chunks, rows):
        if dataset.id.get_chunk_info_by_coord(offset).size * MOST_DEFLATED <= MAX_CHUNK_BYTES:
            continue
        mask, packed = dataset.id.read_direct_chunk(offset)
        if not mask & skipped and len(zlib.decompressobj().decompress(packed, most + 1)) > most:
            raise ValueError(f"the chunk at {offset} unpacks to more than its {most - CHECKSUM_BYTES:,} bytes")


def _filters(plan: h5py.h5p.PropDCID) -> list[int]:
    """The codes of a dataset's filters, in the order of writing."""
    return [plan.get_filter(index)[0] for index in range(plan.get_nfilters())]


def _offsets(shape: tuple[int, ...], chunks: tuple[int, ...], rows: np.ndarray) -> Iterator[tuple[int, ...]]:
    """Where the chunks that hold some rows begin."""
    first, *others = chunks
    starts = np.flatnonzero(np.bincount(rows // first)) * first
    ranges = (range(0, length, step) for length, step in zip(shape[1:], others, strict=True))
    return itertools.product(starts.tolist(), *ranges)
