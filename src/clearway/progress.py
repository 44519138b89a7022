"""How far long work has come, on standard error: a bar where that is a terminal, elsewhere a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

FIRST_LINE_S, MOST_S_BETWEEN_LINES = 10.0, 300.0


class LineTimes:
    """When a line is due: after some seconds, then ever more rarely: a wait is twice the one before, up to a limit."""

    def __init__(self, now: float) -> None:
        self._wait_s = FIRST_LINE_S
        self._due = now + self._wait_s

    def is_due(self, now: float) -> bool:
        """Whether a line is to be printed now; then the next is due later."""
        if now < self._due:
            return False
        self._wait_s = min(2 * self._wait_s, MOST_S_BETWEEN_LINES)
        self._due = now + self._wait_s
        return True


@contextmanager
def work_progress(label: str, total: int, wanted: bool, unit: str = "pictures") -> Iterator[Callable[[int], None]]:
    """A progress bar of pictures, or of a unit; yields what to call with the number of them done so far.

    If standard error is not a terminal, a line now and then instead. `unit` is what they are.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if wanted and not console.is_terminal:
        yield _lines(label, total, unit)
        return
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(f"{unit},"),
    )
    with Progress(*columns, TimeRemainingColumn(), TextColumn("left"), console=console, disable=not wanted) as bar:
        task = bar.add_task(label, total=total)
        yield lambda done: bar.update(task, completed=done)


def _lines(label: str, total: int, unit: str) -> Callable[[int], None]:
    times = LineTimes(time.monotonic())

    def show(done: int) -> None:
        if times.is_due(time.monotonic()):
            print(f"{label}: {done:,} of {total:,} {unit}", file=sys.stderr, flush=True)

    return show
