"""Picture files as the pictures of a scene, of any size and shape, read when they are looked at."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from clearway.errors import SceneError, reason_of
from clearway.importers.picture_limits import check_picture_size
from clearway.regular_files import opened
from clearway.scenes.file_pictures import file_stamp
from clearway.scenes.memory_limits import array_limit

MAX_PICTURE_PIXELS = 80_000_000  # a photograph that unpacks to more is refused before it is unpacked
PIXEL_BYTES = 4  # in memory
FORMATS = ("JPEG", "PNG", "WEBP", "BMP", "TIFF")
DEEP_MODES = ("I", "F")  # what Pillow calls the modes of 16 and 32 bits begins so
HEIGHT_PX = 300
_FAULTS = (  # what the readers of the formats raise
    OSError,
    EOFError,
    SyntaxError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RuntimeError,
    MemoryError,
    struct.error,
    zlib.error,
)


@dataclass(frozen=True)
class Photographs:
    """Pictures (S, height, width, 3) uint8, read from their files, cut and scaled when they are looked at.

    Attributes:
        paths: S files.
        stamps: what each file was like when the scene was made, see `file_stamp`.
        shape: (S, height, width, 3).
    """

    paths: tuple[Path, ...]
    stamps: tuple[tuple[int | str, ...], ...]
    shape: tuple[int, ...]

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        """The pictures asked for.

        Raises:
            SceneError: a file is gone, has changed, is no picture, or a grey one of more than 8 bits.
        """
        wanted = np.arange(self.shape[0])[index]
        pictures = np.empty((wanted.size, *self.shape[1:]), np.uint8)
        for place, state in enumerate(wanted.reshape(-1).tolist()):
            path = self.paths[state]
            if file_stamp(path) != self.stamps[state]:
                raise SceneError(path, "has changed since its scene was made", "Import the pictures again")
            pictures[place] = _photograph(path, *self.shape[1:3])
        return pictures.reshape(*wanted.shape, *self.shape[1:])


def picture_within(folder: Path, name: str) -> Path | None:
    """The file of that name in a folder or below it; None where there is none, or the name leads elsewhere."""
    try:
        inside = folder.resolve()
        path = (inside / name).resolve()
        return path if path.is_relative_to(inside) and path.is_file() else None
    except (OSError, ValueError):  # a name too long, or with a null byte
        return None


def photographs(paths: Sequence[Path], height_px: int = HEIGHT_PX, width_px: int | None = None) -> Photographs:
    """Picture files as pictures of one size.

    Args:
        paths: S files.
        height_px: of the pictures.
        width_px: of the pictures; None: as the sides of the first file say. Others are cut to fit.

    Raises:
        SceneError: the first file is no picture, or a grey one of more than 8 bits; or the size is too large.
    """
    if width_px is None:
        width, height = _opened(paths[0]).size
        width_px = max(1, round(height_px * width / height))
    check_picture_size(paths[0], height_px, width_px)
    return Photographs(tuple(paths), tuple(map(file_stamp, paths)), (len(paths), height_px, width_px, 3))


def _opened(path: Path) -> Image.Image:
    """The picture as it is meant to be seen, not unpacked where it would be too large."""
    try:
        with opened(path) as file, Image.open(file, formats=FORMATS) as picture:
            most = min(MAX_PICTURE_PIXELS, array_limit(path) // PIXEL_BYTES)
            if math.prod(picture.size) > most:
                problem = f"has {picture.size[0]} x {picture.size[1]} pixels, more than {most:,} for a file of its size"
                raise SceneError(path, problem, "Scale it down")
            if picture.mode.startswith(DEEP_MODES):  # which `convert` would cut off at white
                problem = f"has more than 8 bits a channel (mode {picture.mode})"
                raise SceneError(path, problem, "Save it with 8 bits")
            upright = ImageOps.exif_transpose(picture)
            return upright if upright.mode == "RGB" else upright.convert("RGB")
    except SceneError:
        raise
    except (*_FAULTS, Image.DecompressionBombError) as fault:
        kinds = ", ".join(FORMATS)
        raise SceneError(path, f"cannot be read as a picture ({reason_of(fault)})", f"Give one of {kinds}") from fault


def _photograph(path: Path, height_px: int, width_px: int) -> np.ndarray:
    """(height, width, 3) uint8: scaled to fill, and cut evenly where the sides' ratio differs."""
    return np.asarray(ImageOps.fit(_opened(path), (width_px, height_px), Image.Resampling.LANCZOS))
