"""What all commands print alike: JSON, tables, warnings."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.errors import printable
from clearway.files import json_text

if TYPE_CHECKING:
    from rich.console import Console


def print_json(content: object) -> None:
    """Print JSON to standard output."""
    print(json_text(content), end="")


def stdout_console() -> Console:
    """A console for tables, which takes brackets in names as they are."""
    from rich.console import Console

    return Console(markup=False, emoji=False)


def stderr_console() -> Console:
    """A console for all that is not the result itself, which takes brackets in names as they are."""
    from rich.console import Console

    return Console(stderr=True, markup=False, emoji=False, highlight=False)


def say(text: str) -> None:
    """Print a line on standard error as it is, however long, but for characters that are not printable."""
    stderr_console().print(printable(text), soft_wrap=True)


def say_begun(text: str) -> None:
    """Say what takes a while, where no terminal shows how far it has come."""
    if not stderr_console().is_terminal:
        say(text)


def say_made(folder: Path, paths: Sequence[Path], there: Set[Path]) -> None:
    """Say how many of some files of a folder were made, how many were there, and which they are."""
    made = sum(path not in there for path in paths)
    kept = f", {len(paths) - made} were there" if made < len(paths) else ""
    which = paths[0].name if len(paths) == 1 else f"{paths[0].name} to {paths[-1].name}"
    say(f"{folder}: {made} made{kept}, {which}")


def say_held_out(targets: Mapping[str, Sequence[int]]) -> None:
    """Say which held-out targets, by scene name, were drawn."""
    drawn = (f"{scene}={','.join(map(str, states))}" for scene, states in targets.items())
    say(f"held-out targets: {' '.join(drawn)}")


@contextmanager
def showing_warnings() -> Iterator[None]:
    """Print warnings on standard error, each once and in one line, whatever Python was told about warnings."""
    told: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
        text = " ".join(str(message).split())
        if text not in told:
            told.add(text)
            say(f"warning: {text}")

    with warnings.catch_warnings():
        warnings.simplefilter("default", UserWarning)
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", FutureWarning)
        warnings.showwarning = show
        yield
