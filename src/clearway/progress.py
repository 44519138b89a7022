"""The progress bar of work on pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def picture_progress(label: str, total: int, wanted: bool, unit: str = "pictures") -> Iterator[Callable[[int], None]]:
    """A progress bar of pictures, or of a unit; yields what to call with the number of them done so far.

    Silent if standard error is not a terminal. `unit` is what they are.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(f"{unit},"),
    )
    shown = wanted and console.is_terminal
    with Progress(*columns, TimeRemainingColumn(), TextColumn("left"), console=console, disable=not shown) as bar:
        task = bar.add_task(label, total=total)
        yield lambda done: bar.update(task, completed=done)
