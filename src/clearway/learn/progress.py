"""The progress of a training run on standard error: frames/s, solved targets, time left.

A bar where that is a terminal; elsewhere, for example in a batch system's log, a line now and then.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from clearway.progress import LineTimes


class ProgressView(Protocol):
    """Shows how far training has come."""

    def show(self, frames: int, solved: int, targets: int) -> None:
        """Frames so far; targets that every recent training episode reached, of how many."""


class _Silent:
    def show(self, frames: int, solved: int, targets: int) -> None:
        """Show nothing."""


class _Lines:
    """A line now and then, see `LineTimes`."""

    def __init__(self, frames: int) -> None:
        self.all_frames = frames
        self.began: float | None = None
        self.frames_before = 0
        self.times: LineTimes | None = None

    def show(self, frames: int, solved: int, targets: int) -> None:
        """Print a line where one is due."""
        now = time.monotonic()
        if self.began is None or self.times is None:
            self.began, self.frames_before, self.times = now, frames, LineTimes(now)
        elif self.times.is_due(now):
            rate = (frames - self.frames_before) / max(now - self.began, 1e-9)
            left = max(self.all_frames - frames, 0) / max(rate, 1e-9)
            progress = f"training: {frames:,} of {self.all_frames:,} frames, {rate:,.0f} frames/s"
            solved_told = f"solved {solved} of {targets}"
            print(f"{progress}, {solved_told}, {_duration(left)} left", file=sys.stderr, flush=True)


def _duration(seconds: float) -> str:
    """Hours, minutes and seconds, such as 1:02:03."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"


@contextmanager
def progress_view(frames: int, visible: bool) -> Iterator[ProgressView]:
    """A progress bar up to `frames` on the terminal's standard error, lines where it is none, or nothing."""
    if not visible:
        yield _Silent()
        return
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Lines(frames)
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("training"),
        BarColumn(),
        TextColumn("{task.completed:,.0f}/{task.total:,.0f} frames"),
        TextColumn("{task.fields[rate]:,.0f} frames/s"),
        TextColumn("solved {task.fields[solved]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as bar:
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
