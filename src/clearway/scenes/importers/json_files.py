"""JSON files of others, read with a limit on their size and every fault as one `SceneError`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from clearway.errors import SceneError

MAX_JSON_BYTES = 512 * 1024**2


def read_json(path: Path) -> Any:
    """What a JSON file holds.

    Raises:
        SceneError: there is no such file, it is too large, or not JSON.
    """
    if not path.is_file():
        raise SceneError(path, "there is no such file", "Give the whole folder of the data set")
    if path.stat().st_size > MAX_JSON_BYTES:
        raise SceneError(path, f"is larger than {MAX_JSON_BYTES >> 20} MiB", "Give another copy")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as fault:
        reason = " ".join(str(fault).split())[:200]
        raise SceneError(path, f"cannot be read as JSON ({reason})", "Get another copy") from fault
