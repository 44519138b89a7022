"""A user's own photographs as a scene: a folder of pictures and a table that says where each was taken.

The table is a CSV file with the columns `file` (relative to the table's folder), `x`, `z` (metres) and `heading`
(degrees, 0 along +z, 90 along +x). Every location needs the same evenly spaced headings. A second CSV file with the
columns `x1`, `z1`, `x2`, `z2` may name edges that are blocked, for example by a table between two locations.
"""

from __future__ import annotations

import csv
import io
import math
import warnings
from pathlib import Path

import numpy as np

from clearway.errors import SceneError
from clearway.importers.photographs import HEIGHT_PX, photographs, picture_within
from clearway.importers.pose_graph import recorded_pose_graph
from clearway.regular_files import read_text
from clearway.scenes.graph import components
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.validate import MAX_COORDINATE_M, MAX_STATES, SceneWarning, check_scene
from clearway.version import __version__

SOURCE = "images"
POSE_COLUMNS, EDGE_COLUMNS = ("file", "x", "z", "heading"), ("x1", "z1", "x2", "z2")
MAX_TABLE_BYTES = 16 * 1024**2


def read_images(
    table: Path,
    *,
    step_m: float,
    blocked: Path | None = None,
    name: str | None = None,
    height_px: int = HEIGHT_PX,
    width_px: int | None = None,
) -> Scene:
    """A scene of photographs, without features.

    Args:
        table: CSV file of the poses; pictures are beside it or in folders beside it.
        step_m: length of a move: how far neighbouring locations are apart.
        blocked: CSV file of blocked edges.
        name: of the scene; the table's stem where it is not given.
        height_px: of the scene's pictures.
        width_px: of the scene's pictures; None: as the first picture's sides say. Others are cut to fit.

    Raises:
        SceneError: a table cannot be read or does not fit, or a picture is missing, too large or none.

    Warns:
        SceneWarning: some locations cannot be reached from others.
    """
    if not 0 < step_m < math.inf:
        raise SceneError(table, f"a step of {step_m} m", "Give a length above 0")
    rows = _rows(table, POSE_COLUMNS)
    paths = tuple(_picture_path(table, number, row[0]) for number, row in rows)
    numbers = np.array([_numbers(table, number, row[1:]) for number, row in rows])
    locations_m, headings_deg = numbers[:, :2], numbers[:, 2] % 360
    edges = None
    if blocked is not None:
        lines = _rows(blocked, EDGE_COLUMNS)
        edges = np.array([_numbers(blocked, number, row) for number, row in lines]).reshape(-1, 2, 2)
    graph = recorded_pose_graph(
        locations_m, headings_deg, step_m, blocked_edges=edges, source=table, blocked_source=blocked
    )
    parts = int(components(graph).max()) + 1
    if parts > 1:
        text = f"{table}: the locations form {parts} parts without a way between them. Check --step and what is blocked"
        warnings.warn(text, SceneWarning, stacklevel=2)
    scene = Scene(
        name=name or table.stem,
        observations=photographs(paths, height_px, width_px),
        features=None,
        locations_m=locations_m,
        headings_deg=np.round(headings_deg).astype(np.int64) % 360,
        graph=graph,
        made_by=Provenance(SOURCE, versions={"clearway": __version__}, notes={"table": table.name}),
        cell_size_m=step_m,
    )
    check_scene(scene, table)
    return scene


def _rows(path: Path, columns: tuple[str, ...]) -> list[tuple[int, list[str]]]:
    """The columns of a CSV file, in this order, without its first line; with the number of each line."""
    if not path.exists():
        raise SceneError(path, "there is no such file", "Check the path")
    try:
        reader = csv.reader(io.StringIO(read_text(path, MAX_TABLE_BYTES, "utf-8-sig"), newline=""))
        lines = [(reader.line_num, line) for line in reader if line]
    except OSError as fault:
        raise SceneError(path, f"cannot be read ({fault.strerror})", "Give a table of poses") from fault
    except (UnicodeDecodeError, csv.Error) as fault:
        raise SceneError(path, f"is no CSV file ({fault})", "Save it as comma-separated text in UTF-8") from fault
    head = [word.strip().lower() for word in lines[0][1]] if lines else []
    lacking = [column for column in columns if column not in head]
    if lacking:
        raise SceneError(path, f"lacks the column {lacking[0]}", f"Head it with {','.join(columns)}")
    places = [head.index(column) for column in columns]
    for number, line in lines[1:]:
        if len(line) < len(head):
            raise SceneError(path, f"line {number} has fewer values than columns", f"Give all of {', '.join(columns)}")
        if any(line[len(head) :]):
            problem = f"line {number} has {len(line)} values in {len(head)} columns"
            raise SceneError(path, problem, "Write decimals with a point, and put texts with commas in quotes")
    rows = [(number, [line[place].strip() for place in places]) for number, line in lines[1:]]
    if not 1 <= len(rows) <= MAX_STATES:
        raise SceneError(path, f"has {len(rows)} rows, expected 1 to {MAX_STATES}", "Give one row a pose or edge")
    return rows


def _numbers(path: Path, number: int, words: list[str]) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(value) and abs(value) <= MAX_COORDINATE_M for value in values):
        problem = f"line {number} holds {','.join(words)[:60]!r}"
        raise SceneError(path, problem, f"Write numbers up to {MAX_COORDINATE_M:,.0f} in metres or degrees")
    return values


def _picture_path(table: Path, number: int, word: str) -> Path:
    path = picture_within(table.parent, word)
    if path is None:
        problem = f"line {number} names {word[:80]!r}, which is no file in the table's folder"
        raise SceneError(table, problem, "Correct the name, or put the file there")
    return path
