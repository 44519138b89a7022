"""Results that are found once and then read from a file, as long as it belongs to the same question."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clearway.files import read_json, written_whole


def kept(path: Path, question: Mapping[str, Any], name: str) -> Any | None:
    """What `keep` wrote under a name; None where the file is missing, damaged or belongs to another question."""
    try:
        content = read_json(path)
        return content[name] if all(content[part] == value for part, value in question.items()) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def keep(path: Path, question: Mapping[str, Any], results: Mapping[str, Any]) -> None:
    """Write results with the question that they answer; all of it must be JSON that reads back as it was."""
    with written_whole(path) as part:
        part.write_text(json.dumps({**question, **results}, indent=1) + "\n", encoding="utf-8")
