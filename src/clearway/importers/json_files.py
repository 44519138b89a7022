"""JSON files of others, read with a limit on their size and every fault as one `SceneError`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from clearway import files
from clearway.errors import SceneError, reason_of


def read_json(path: Path) -> Any:
    """What a JSON file holds.

    Raises:
        SceneError: there is no such file, it is too large, or not JSON.
    """
    if not path.exists():
        raise SceneError(path, "there is no such file", "Give the whole folder of the data set")
    try:
        return files.read_json(path)
    except (OSError, ValueError) as fault:
        raise SceneError(path, f"cannot be read as JSON ({reason_of(fault)})", "Get another copy") from fault
