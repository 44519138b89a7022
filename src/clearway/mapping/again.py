"""Whether pictures repeat: whether a pose shows the same picture whenever it is come to, to the bit.

On a grid without noise they do, behind a real camera never. An agent is not told; it finds out.
"""

from __future__ import annotations

import zlib
from enum import IntEnum

import numpy as np


class Repeats(IntEnum):
    """What is known of it: a picture was seen again; or a pose was come to again, and showed another."""

    UNKNOWN = 0
    NEVER = 1
    ALWAYS = 2


def marks_of(features: np.ndarray) -> np.ndarray:
    """(B,) uint32, above 0: checksums by which features (B, F) are told apart, rounded to half precision."""
    half = np.ascontiguousarray(features, np.float16)
    return np.array([max(zlib.crc32(row.tobytes()), 1) for row in half], np.uint32)
