"""Evaluations as files: JSON for programs, Markdown for people."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clearway.evaluation.summary import Evaluation
from clearway.evaluation.tables import markdown_table
from clearway.files import json_text, written_whole


def write_evaluations(
    folder: Path, content: object, evaluations: Sequence[Evaluation], name: str = "evaluation"
) -> None:
    """Leave evaluation.json and evaluation.md in a folder.

    Args:
        folder: a run's or a demo's.
        content: what the command prints with --json.
        evaluations: rows of the table, the main figures.
        name: of the files, in place of "evaluation".
    """
    with written_whole(folder / f"{name}.json") as part:
        part.write_text(json_text(content), encoding="utf-8")
    with written_whole(folder / f"{name}.md") as part:
        part.write_text(markdown_table(evaluations, "scenes", width="page"), encoding="utf-8")
