"""Episode tables as JSON files: every episode kept, so that any figure can be computed again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import RunError
from clearway.evaluation.episodes import EpisodeTable
from clearway.files import read_kept, written_whole

FORMAT_VERSION = 1
_FLAGS = ("reached", "looped")
_COLUMNS = tuple(field.name for field in fields(EpisodeTable) if field.default is MISSING)


def write_episodes(path: Path, table: EpisodeTable, about: Mapping[str, object]) -> None:
    """Write a table without its trajectories and arrivals, and what it is about (JSON values)."""
    columns = {name: getattr(table, name).astype(np.int64).tolist() for name in _COLUMNS}
    content = {"format_version": FORMAT_VERSION, "about": dict(about), "episodes": columns}
    with written_whole(path) as part:
        part.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")


def read_episodes(path: Path) -> tuple[EpisodeTable, dict[str, Any]]:
    """The table and what it is about.

    Raises:
        RunError: the file is missing, damaged or of a newer version.
    """

    def taken(content: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        columns = {name: np.array(content["episodes"][name], np.int64) for name in _COLUMNS}
        return columns, dict(content["about"])

    columns, about = read_kept(path, FORMAT_VERSION, taken)
    for name in _FLAGS:
        columns[name] = columns[name].astype(bool)
    if len({len(column) for column in columns.values()}) != 1:
        raise RunError(f"{path}: its columns differ in length. Remove it, and it is made again")
    return EpisodeTable(**columns, trajectories=None), about
