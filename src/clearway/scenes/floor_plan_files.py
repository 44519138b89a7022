"""Reads floor plans from files.

.npz  NumPy arrays, one a plan, named by it: (C, 2) whole numbers, x and z of each reachable cell; or a bool map (X, Z).
.csv  Either the header "x,z" and a line for each reachable cell, or a map of 0 (blocked) and 1 (reachable).
.txt  A map in characters: "#" is blocked, "." can be reached, "W" is a wall up to the ceiling, "D" a door in it.

Maps in .csv and .txt files are seen from above: the first line is the far end (largest z), the first column the
smallest x; the last line is z = 0, the first column x = 0.
"""

from __future__ import annotations

import io
import math
import re
import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from clearway.errors import SceneError, reason_of
from clearway.regular_files import opened, read_text
from clearway.scenes.floor_plans import CELL_SIZE_M, FloorPlan, grid_from_above

SUFFIXES = (".npz", ".csv", ".txt")
MAX_BYTES = 8 * 1024**2  # of a text file, or of an unpacked array
PLAIN_NAME = re.compile(r"\w[\w .+-]{0,99}")  # of a plan, which becomes the name of a file
WHOLE_NUMBER = re.compile(r"-?[0-9]{1,9}")
NPY = ".npy"
DRAWN_CELL_SIZE_M = 0.5  # of maps that are drawn by hand
PACKING = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # what `zipfile` unpacks piece by piece
_FAULTS = (OSError, EOFError, ValueError, TypeError, LookupError, RuntimeError, MemoryError, ArithmeticError)


def floor_plan_names(path: Path) -> tuple[str, ...]:
    """The plans in a file, in its order; a text file holds one, of the file's own name.

    Raises:
        SceneError: there is no such file, or it cannot be read.
    """
    _check_file(path)
    if path.suffix != ".npz":
        return (path.stem,)
    with _faults_named(path), opened(path) as file, zipfile.ZipFile(file) as archive:
        names = tuple(name.removesuffix(NPY) for name in archive.namelist() if name.endswith(NPY))
    if not names:
        raise SceneError(path, "holds no array", "Store one array a plan with numpy.savez")
    return names


def read_floor_plan(path: Path, name: str | None = None, *, cell_size_m: float | None = None) -> FloorPlan:
    """A plan from a .npz, .csv or .txt file (formats: see the top of this file).

    Args:
        path: the file.
        name: of the plan; may be left out where the file holds one.
        cell_size_m: side of a cell, metres; None: 0.5, of plans in .npz 0.25, as the published ones have.

    Raises:
        SceneError: there is no such file or plan, it cannot be read, or it is no plan.
    """
    names = floor_plan_names(path)
    if name is None and len(names) > 1:
        raise SceneError(path, f"holds {len(names)} plans", f"Name one of {_listed(names)}")
    (plan,) = read_floor_plans(path, names[:1] if name is None else (name,), cell_size_m=cell_size_m)
    return plan


def read_floor_plans(path: Path, names: Sequence[str] = (), *, cell_size_m: float | None = None) -> list[FloorPlan]:
    """Several plans from a file, which is opened once; all of them where no names are given.

    Raises:
        SceneError: see `read_floor_plan`.
    """
    held = floor_plan_names(path)
    if cell_size_m is None:
        cell_size_m = CELL_SIZE_M if path.suffix == ".npz" else DRAWN_CELL_SIZE_M
    with ExitStack() as stack:
        archive = None
        if path.suffix == ".npz":
            with _faults_named(path):
                file = stack.enter_context(opened(path))
                archive = stack.enter_context(zipfile.ZipFile(file))
        return [_read_plan(path, archive, name, held, cell_size_m) for name in names or held]


def _read_plan(
    path: Path, archive: zipfile.ZipFile | None, chosen: str, names: tuple[str, ...], cell_size_m: float
) -> FloorPlan:
    """A plan from a text file, or from an archive of arrays."""
    if chosen not in names:
        raise SceneError(path, f"holds no plan named {chosen}", f"Name one of {_listed(names)}")
    if not PLAIN_NAME.fullmatch(chosen):
        remedy = "Use letters, digits, spaces, points and dashes alone"
        raise SceneError(path, f"the plan's name {chosen[:100]!r} is no name for a file", remedy)
    if path.suffix == ".txt":
        return FloorPlan.of_text(chosen, _read_text(path), cell_size_m=cell_size_m, source=str(path))
    if archive is not None:
        values, dataset = _read_array(path, archive, chosen), chosen
    else:
        values, dataset = _csv_values(path, _read_text(path)), ""
    if values.dtype == np.bool_ and values.ndim == 2:
        return FloorPlan.of_map(chosen, values, cell_size_m=cell_size_m, source=str(path), dataset=dataset)
    return FloorPlan(chosen, values, cell_size_m=cell_size_m, source=str(path), dataset=dataset)


def _check_file(path: Path) -> None:
    if not path.exists():
        raise SceneError(path, "there is no such file", "Check the path")
    if path.suffix not in SUFFIXES:
        problem = f"its name ends in '{path.suffix}', expected {' or '.join(SUFFIXES)}"
        raise SceneError(path, problem, "Rename or convert the file")


def _listed(names: tuple[str, ...]) -> str:
    """Some names for an error, the rest counted."""
    shown = ", ".join(names[:10])
    return f"{shown} and {len(names) - 10} more" if len(names) > 10 else shown


@contextmanager
def _faults_named(path: Path, dataset: str = "") -> Iterator[None]:
    """Turn whatever reading raises within into one `SceneError`."""
    try:
        yield
    except (*_FAULTS, SyntaxError, tokenize.TokenError, zipfile.BadZipFile, zlib.error) as fault:
        remedy = "Make the file again or get another copy"
        raise SceneError(path, f"cannot be read ({reason_of(fault)})", remedy, dataset) from fault


def _read_array(path: Path, archive: zipfile.ZipFile, name: str) -> np.ndarray:
    """An array of a .npz file; pickled objects are refused."""
    with _faults_named(path, name):
        member = archive.getinfo(name + NPY)
        if member.file_size > MAX_BYTES:
            raise ValueError(f"it would unpack to more than {MAX_BYTES >> 20} MiB")
        if member.compress_type not in PACKING:
            raise ValueError(f"it is packed by method {member.compress_type}, expected deflate")
        content = io.BytesIO(archive.read(member))
    with _faults_named(path, name):
        _check_length(content)
        return np.lib.format.read_array(content, allow_pickle=False)


def _check_length(content: io.BytesIO) -> None:
    """Check that an array's header claims no more than what follows it, and leave the reader at the start."""
    version = np.lib.format.read_magic(content)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read_header(content)
    claimed, held = math.prod(shape) * dtype.itemsize, len(content.getvalue()) - content.tell()
    if not dtype.hasobject and not 0 <= claimed <= held:
        raise ValueError(f"it claims {claimed:,} bytes and holds {held:,}")
    content.seek(0)


def _read_text(path: Path) -> list[str]:
    """The lines of a text file, without empty ones before and after."""
    with _faults_named(path):
        lines = [line.strip() for line in read_text(path, MAX_BYTES, "utf-8-sig").strip().splitlines()]
    if not lines:
        raise SceneError(path, "is empty", "Give a map or a list of cells")
    return lines


def _csv_values(path: Path, lines: list[str]) -> np.ndarray:
    """Cells (C, 2) int64, or a map (X, Z) bool, from comma-separated lines."""
    rows = [[word.strip() for word in line.split(",")] for line in lines]
    if rows[0] == ["x", "z"]:
        return np.array([_cell(path, number, row) for number, row in enumerate(rows[1:], 2)], np.int64).reshape(-1, 2)
    return grid_from_above(path, rows, {"0": "blocked", "1": "reachable"}) == "1"


def _cell(path: Path, number: int, row: list[str]) -> tuple[int, int]:
    if len(row) != 2 or not all(WHOLE_NUMBER.fullmatch(word) for word in row):
        problem = f"line {number} is {','.join(row)[:40]!r}, expected two whole numbers, x and z"
        raise SceneError(path, problem, "Write one cell a line")
    return int(row[0]), int(row[1])
