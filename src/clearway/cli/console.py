"""What all commands print alike: JSON, tables, warnings."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from rich.console import Console

SCENE_SUFFIXES = (".h5", ".hdf5")


def print_json(content: object) -> None:
    """Print JSON to standard output."""
    print(json.dumps(content, indent=2))


def stderr_console() -> Console:
    """A console for all that is not the result itself."""
    from rich.console import Console

    return Console(stderr=True)


@contextmanager
def showing_warnings() -> Iterator[None]:
    """Print warnings as framed text on standard error; each once."""

    def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
        from rich.panel import Panel
        from rich.text import Text

        frame = Panel(Text(str(message)), title="warning", border_style="yellow", title_align="left")
        stderr_console().print(frame)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", FutureWarning)
        warnings.showwarning = show
        yield


def scene_files(paths: Sequence[Path]) -> list[Path]:
    """The scene files that some paths name: files as they are, folders by the scene files in them.

    Raises:
        ClearwayError: a path does not exist, or a folder holds no scene file.
    """
    files: list[Path] = []
    for path in paths:
        if path.is_dir():
            found = sorted(p for p in path.iterdir() if p.suffix in SCENE_SUFFIXES)
            if not found:
                raise ClearwayError(f"{path}: no scene file ({', '.join(SCENE_SUFFIXES)}) in this folder. Name another")
            files += found
        elif path.exists():
            files.append(path)
        else:
            raise ClearwayError(f"{path}: no such file. Check the path, or make a scene with clearway scenes build")
    if not files:
        raise ClearwayError("no scene file given. Name at least one, or make one with clearway scenes build")
    return files
