"""Pictures to send to a service, its token, and the environment of one in a process of its own."""

from __future__ import annotations

import io
import os
import socket
import sys

import numpy as np
from PIL import Image

from clearway.serve.tokens import Tokens
from helpers.sums import plain

OWNER, TOKEN = "robot", "a-token-for-the-tests"
TOKENS = Tokens([(OWNER, TOKEN)])
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


def picture_bytes(picture: np.ndarray, kind: str = "PNG", **settings: object) -> bytes:
    """A picture file's content."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, kind, **settings)
    return file.getvalue()


def grey(level: int) -> bytes:
    """A PNG file of one grey level."""
    return picture_bytes(plain(level))


def many_scans(picture: np.ndarray, more: int) -> bytes:
    """A progressive JPEG whose last scan comes `more` times again; each goes over the whole picture."""
    content = picture_bytes(picture, "JPEG", quality=75, progressive=True)
    last = content[content.rindex(b"\xff\xda") : content.rindex(b"\xff\xd9")]
    return content.removesuffix(b"\xff\xd9") + last * more + b"\xff\xd9"


def until_closed(connection: socket.socket) -> bytes:
    """All that arrives before the other side closes or resets the connection."""
    found = b""
    try:
        while part := connection.recv(65536):
            found += part
    except ConnectionResetError:
        pass
    return found
