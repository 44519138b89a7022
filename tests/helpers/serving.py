"""Pictures to send to a service, its token, and the environment of one in a process of its own."""

from __future__ import annotations

import io
import os
import sys

import numpy as np
from PIL import Image

from helpers.sums import plain

TOKEN = "a-token-for-the-tests"
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


def picture_bytes(picture: np.ndarray, kind: str = "PNG", **settings: object) -> bytes:
    """A picture file's content."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, kind, **settings)
    return file.getvalue()


def grey(level: int) -> bytes:
    """A PNG file of one grey level."""
    return picture_bytes(plain(level))
