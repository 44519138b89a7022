"""The progress bar of a training run: frames/s, solved targets, time left."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol


class ProgressView(Protocol):
    """Shows how far training has come."""

    def show(self, frames: int, solved: int, targets: int) -> None:
        """Frames so far; targets that every recent training episode reached, of how many."""


class _Silent:
    def show(self, frames: int, solved: int, targets: int) -> None:
        """Show nothing."""


@contextmanager
def progress_view(frames: int, visible: bool) -> Iterator[ProgressView]:
    """A progress bar up to `frames` on the terminal's standard error, or nothing."""
    if not visible:
        yield _Silent()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("training"),
        BarColumn(),
        TextColumn("{task.completed:,.0f}/{task.total:,.0f} frames"),
        TextColumn("{task.fields[rate]:,.0f} frames/s"),
        TextColumn("solved {task.fields[solved]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("training", total=frames, rate=0.0, solved="-")

        class Bar:
            def show(self, frames: int, solved: int, targets: int) -> None:
                """Move the bar."""
                rate = bar.tasks[0].speed or 0.0
                bar.update(
                    task,
                    completed=min(frames, bar.tasks[0].total or frames),
                    rate=rate,
                    solved=f"{solved}/{targets}",
                )

        yield Bar()
