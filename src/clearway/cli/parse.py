"""The argument parser's refusals, in one line."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr

from clearway.errors import ClearwayError

CORNERS = ("╭", "╰")
LENGTHY = ("Perhaps you meant", "Argument helptext")  # parts of a refusal that --help says better


@contextmanager
def refusals_in_one_line() -> Iterator[None]:
    """Turn the frame that tyro prints about words it cannot read into a `ClearwayError`; help is printed as ever."""
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            yield
    except SystemExit as leaving:
        if not leaving.code:
            raise
        raise ClearwayError(one_line(said.getvalue())) from leaving


def one_line(framed: str) -> str:
    """What a framed message says: the beginning of each of its parts, which rules divide."""
    from rich.text import Text

    rows = Text.from_ansi(framed).plain.splitlines()
    inside = "\n".join(row.strip("│ ") for row in rows if not row.startswith(CORNERS))
    parts = [" ".join(part.strip().split("\n\n")[0].split()) for part in re.split("─{3,}", inside)]
    return ". ".join(part.rstrip(".") for part in parts if part and not part.startswith(LENGTHY))
