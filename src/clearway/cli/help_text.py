"""Help whose first lines, usage and description, are as wide as the terminal, as its frames are already."""

from __future__ import annotations

import io
import shutil
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import TextIO

USAGE = "usage: "
FRAMES = ("╭", "+")  # how the first frame begins, in any terminal's letters


class _Kept(io.StringIO):
    """What is printed, kept; it looks like the stream that it stands for, by which the printer chooses its letters."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream

    @property
    def encoding(self) -> str | None:  # type: ignore[override]
        """Of the stream."""
        return getattr(self._stream, "encoding", None)

    def isatty(self) -> bool:
        """Of the stream."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Of the stream."""
        return self._stream.fileno()


@contextmanager
def help_wrapped() -> Iterator[None]:
    """Wrap the help that the block prints; whatever else it prints stays as it is."""
    kept = _Kept(sys.stdout)
    try:
        with redirect_stdout(kept):
            yield
    finally:
        sys.stdout.write(_wrapped(kept.getvalue()))


def _wrapped(printed: str) -> str:
    lines = printed.splitlines(keepends=True)
    plain = [_plain(line) for line in lines]
    if not plain or not plain[0].startswith(USAGE):
        return printed
    framed = next((number for number, line in enumerate(plain) if line.startswith(FRAMES)), len(lines))
    width = shutil.get_terminal_size().columns
    first = zip(plain[:framed], lines[:framed], strict=True)
    head = [_folded(told, width) if len(told) > width else line for told, line in first]
    return "".join([*head, *lines[framed:]])


def _plain(line: str) -> str:
    """A line without its end and what colours it."""
    from rich.text import Text

    return Text.from_ansi(line.rstrip("\n")).plain


def _folded(line: str, width: int) -> str:
    usage = line.startswith(USAGE)
    text = line.replace(",", ", ") if usage else line
    indent = " " * len(USAGE) if usage else ""
    return textwrap.fill(text, width, subsequent_indent=indent, break_on_hyphens=False) + "\n"
