"""Whether pictures repeat: whether a pose shows the same picture whenever it is come to, to the bit.

On a grid without noise they do, behind a real camera never. An agent is not told; it finds out. It counts pictures that
came again, up to `ALWAYS`, where it holds it for certain; a pose that was come to again and showed another one says
`NEVER`, from which further pictures that come again lead away, as a pose may be mistaken.
"""

from __future__ import annotations

import zlib

import numpy as np

ALWAYS, UNKNOWN = 3, 0
NEVER = -ALWAYS


def marks_of(features: np.ndarray) -> np.ndarray:
    """(B,) uint32, above 0: checksums by which features (B, F) are told apart, rounded to half precision."""
    half = np.ascontiguousarray(features, np.float16)
    return np.array([max(zlib.crc32(row.tobytes()), 1) for row in half], np.uint32)
