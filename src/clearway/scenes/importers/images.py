"""A user's own photographs as a scene: a folder of pictures and a table that says where each was taken.

The table is a CSV file with the columns `file` (relative to the table's folder), `x`, `z` (metres) and `heading`
(degrees, 0 along +z, 90 along +x). Every location needs the same evenly spaced headings. A second CSV file with the
columns `x1`, `z1`, `x2`, `z2` may name edges that are blocked, for example by a table between two locations.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from clearway.errors import SceneError
from clearway.scenes.importers.pose_graph import recorded_pose_graph
from clearway.scenes.pictures import file_stamp
from clearway.scenes.scene import Provenance, Scene
from clearway.scenes.validate import MAX_COORDINATE_M, MAX_STATES
from clearway.version import __version__

SOURCE = "images"
POSE_COLUMNS, EDGE_COLUMNS = ("file", "x", "z", "heading"), ("x1", "z1", "x2", "z2")
MAX_TABLE_BYTES = 16 * 1024**2
MAX_PICTURE_PIXELS = 80_000_000  # a photograph that unpacks to more is refused before it is unpacked
FORMATS = ("JPEG", "PNG", "WEBP", "BMP", "TIFF")
HEIGHT_PX = 300


@dataclass(frozen=True)
class Photographs:
    """Pictures (S, height, width, 3) uint8, read from their files, cut and scaled when they are looked at.

    Attributes:
        paths: S files.
        stamps: what each file was like when the scene was made, see `file_stamp`.
        shape: (S, height, width, 3).
    """

    paths: tuple[Path, ...]
    stamps: tuple[tuple[int, ...], ...]
    shape: tuple[int, ...]

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        """The pictures asked for.

        Raises:
            SceneError: a file is gone, has changed, or is no picture.
        """
        wanted = np.arange(self.shape[0])[index]
        pictures = np.empty((wanted.size, *self.shape[1:]), np.uint8)
        for place, state in enumerate(wanted.reshape(-1).tolist()):
            path = self.paths[state]
            if file_stamp(path) != self.stamps[state]:
                raise SceneError(path, "has changed since its scene was made", "Import the pictures again")
            pictures[place] = _photograph(path, *self.shape[1:3])
        return pictures.reshape(*wanted.shape, *self.shape[1:])


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
    """
    if not 0 < step_m < math.inf:
        raise SceneError(table, f"a step of {step_m} m", "Give a length above 0")
    rows = _rows(table, POSE_COLUMNS)
    paths = tuple(_picture_path(table, number, row[0]) for number, row in enumerate(rows, 2))
    numbers = np.array([_numbers(table, number, row[1:]) for number, row in enumerate(rows, 2)])
    locations_m, headings_deg = numbers[:, :2], numbers[:, 2] % 360
    edges = None
    if blocked is not None:
        lines = enumerate(_rows(blocked, EDGE_COLUMNS), 2)
        edges = np.array([_numbers(blocked, number, row) for number, row in lines]).reshape(-1, 2, 2)
    graph = recorded_pose_graph(locations_m, headings_deg, step_m, blocked_edges=edges, source=blocked or table)
    width = width_px or _width(paths[0], height_px)
    return Scene(
        name=name or table.stem,
        observations=Photographs(paths, tuple(map(file_stamp, paths)), (len(paths), height_px, width, 3)),
        features=None,
        locations_m=locations_m,
        headings_deg=np.round(headings_deg).astype(np.int64) % 360,
        graph=graph,
        made_by=Provenance(SOURCE, versions={"clearway": __version__}, notes={"table": table.name}),
        cell_size_m=step_m,
    )


def _rows(path: Path, columns: tuple[str, ...]) -> list[list[str]]:
    """The columns of a CSV file, in this order, without its first line."""
    if not path.is_file():
        raise SceneError(path, "there is no such file", "Check the path")
    if path.stat().st_size > MAX_TABLE_BYTES:
        raise SceneError(path, f"is larger than {MAX_TABLE_BYTES >> 20} MiB", "Give a table of poses")
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = [line for line in csv.reader(file) if line]
    except (UnicodeDecodeError, csv.Error) as fault:
        raise SceneError(path, f"is no CSV file ({fault})", "Save it as comma-separated text in UTF-8") from fault
    head = [word.strip().lower() for word in lines[0]] if lines else []
    lacking = [column for column in columns if column not in head]
    if lacking:
        raise SceneError(path, f"lacks the column {lacking[0]}", f"Head it with {','.join(columns)}")
    places = [head.index(column) for column in columns]
    short = next((number for number, line in enumerate(lines[1:], 2) if len(line) < len(head)), None)
    if short is not None:
        raise SceneError(path, f"line {short} has fewer values than columns", f"Give all of {', '.join(columns)}")
    rows = [[line[place].strip() for place in places] for line in lines[1:]]
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
    folder = table.parent.resolve()
    path = (folder / word).resolve()
    if not path.is_relative_to(folder):
        raise SceneError(table, f"line {number} names {word!r}, outside the table's folder", "Put it beside the table")
    if not path.is_file():
        raise SceneError(table, f"line {number} names {word!r}, which is no file", "Correct the name, or add it")
    return path


def _opened(path: Path) -> Image.Image:
    """The picture as it is meant to be seen, not unpacked where it would be too large."""
    try:
        with Image.open(path, formats=FORMATS) as picture:
            if math.prod(picture.size) > MAX_PICTURE_PIXELS:
                raise SceneError(path, f"has {picture.size[0]} x {picture.size[1]} pixels", "Scale it down")
            return ImageOps.exif_transpose(picture).convert("RGB")
    except SceneError:
        raise
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as fault:
        kinds = ", ".join(FORMATS)
        raise SceneError(path, f"cannot be read as a picture ({fault})", f"Give one of {kinds}") from fault


def _width(path: Path, height_px: int) -> int:
    width, height = _opened(path).size
    return max(1, round(height_px * width / height))


def _photograph(path: Path, height_px: int, width_px: int) -> np.ndarray:
    """(height, width, 3) uint8: scaled to fill, and cut evenly where the sides' ratio differs."""
    return np.asarray(ImageOps.fit(_opened(path), (width_px, height_px), Image.Resampling.LANCZOS))
