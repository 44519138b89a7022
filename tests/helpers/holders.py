"""Which processes hold a number in a folder that replicas share."""

from __future__ import annotations

import os
from pathlib import Path

from clearway.serve.own_number import is_held


def holders(folder: Path) -> list[int]:
    """Process ids of those that hold a number now.

    Who takes a number locks its file first and writes itself into it then: in between it is not told yet.
    """
    written = [path.read_text() for path in folder.glob("*.number") if is_held(path)]
    return [int(text) for text in written if text and _lives(int(text))]


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
