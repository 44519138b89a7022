"""The state of a plan's runs, read from their folders, while they run: a table that is drawn anew, or lines."""

from __future__ import annotations

import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.experiments.job import frames_left, is_done, run_folder
from clearway.experiments.plan import Job
from clearway.progress import LineTimes

if TYPE_CHECKING:
    from rich.table import Table

SECONDS_BETWEEN_LOOKS = 2.0
MOST_ROWS = 12


@dataclass(frozen=True)
class RunState:
    """How far a run has come.

    Attributes:
        name: of the run.
        kind: what its speed depends on, see `PlannedRun.kind`.
        state: "waiting", "training", "evaluating" or "done".
        frames, all_frames: trained, of how many.
        frames_per_s: of its training so far; None before the first figures.
        solved, targets: targets that its recent training episodes reached, of how many.
        seconds_left: of training; None where nobody knows.
    """

    name: str
    kind: str
    state: str
    frames: int
    all_frames: int
    frames_per_s: float | None
    solved: int
    targets: int
    seconds_left: float | None


def state_of(out: Path, job: Job, under_way: bool) -> RunState:
    """The state of a job's run, from its files: its metrics while it is under way, else its newest checkpoint."""
    rows = run_folder(out, job.run).metrics()
    last = rows[-1] if rows else {"frames": 0, "seconds": 0.0, "solved_targets": 0}
    all_frames = job.run.learner.frames
    speed = int(last["frames"]) / last["seconds"] if last["seconds"] else None
    if is_done(out, job):
        state, frames = "done", all_frames
    elif not under_way:
        state, frames = "waiting", all_frames - frames_left(out, job.run)
    else:
        frames = min(int(last["frames"]), all_frames)
        state = "evaluating" if frames == all_frames else "training"
    left = (all_frames - frames) / speed if speed else None
    targets = sum(len(own) for own in job.run.targets)
    solved = int(last["solved_targets"])
    return RunState(job.run.name, job.run.kind, state, frames, all_frames, speed, solved, targets, left)


class Looks:
    """The states of a plan's runs; of one that is done the files are read once.

    Args:
        out: folder of the reproduction.
        jobs: all runs with their trials.
    """

    def __init__(self, out: Path, jobs: Sequence[Job]) -> None:
        self._out, self._jobs = out, jobs
        self._done: dict[str, RunState] = {}

    def states(self, under_way: Sequence[Job] = ()) -> list[RunState]:
        """All of them, now."""
        names = {job.run.name for job in under_way}
        found = [self._done.get(job.run.name) or state_of(self._out, job, job.run.name in names) for job in self._jobs]
        self._done = {state.name: state for state in found if state.state == "done"}
        return found


@contextmanager
def board(out: Path, jobs: Sequence[Job], visible: bool) -> Iterator[Callable[[Sequence[Job]], None]]:
    """A live table on standard error; yields what to call with the jobs under way.

    If standard error is not a terminal, a line now and then instead.
    """
    if not visible:
        yield lambda under_way: None
        return
    from rich.console import Console
    from rich.live import Live

    console, looks = Console(stderr=True), Looks(out, jobs)
    if not console.is_terminal:
        yield _lines(looks)
        return
    with Live(console=console, auto_refresh=False, transient=True) as live:
        looked = -SECONDS_BETWEEN_LOOKS

        def show(under_way: Sequence[Job]) -> None:
            nonlocal looked
            if time.monotonic() - looked >= SECONDS_BETWEEN_LOOKS:
                looked = time.monotonic()
                live.update(state_table(looks.states(under_way)), refresh=True)

        yield show


def _lines(looks: Looks) -> Callable[[Sequence[Job]], None]:
    times = LineTimes(time.monotonic())

    def show(under_way: Sequence[Job]) -> None:
        if times.is_due(time.monotonic()):
            print(pace(looks.states(under_way)), file=sys.stderr, flush=True)

    return show


def pace(states: Sequence[RunState]) -> str:
    """How many runs are done, and how long the rest of training takes if so many go on side by side; no evaluation.

    Each run is taken to be as fast as those of its kind in the folder have been, wherever they were trained. Where
    there is none yet, the time is the least.
    """
    done, waiting = _count(states)
    beside = len(states) - done - waiting
    told = f"runs: {done} of {len(states)} done, {beside} under way"
    slowness = _slowness(states)
    to_train = [state for state in states if state.frames < state.all_frames]
    known = [(state.all_frames - state.frames) * slowness[state.kind] for state in to_train if state.kind in slowness]
    if not known or not beside:
        return told
    least = "at least " if len(known) < len(to_train) else ""
    return f"{told}, {least}{clock(max([*known, sum(known) / beside]))} of training left at this pace"


def _slowness(states: Sequence[RunState]) -> dict[str, float]:
    """Seconds a frame of each kind of run that has figures."""
    frames: dict[str, int] = defaultdict(int)
    seconds: dict[str, float] = defaultdict(float)
    for state in states:
        if state.frames_per_s and state.frames:  # who waits may have figures, but no checkpoint
            frames[state.kind] += state.frames
            seconds[state.kind] += state.frames / state.frames_per_s
    return {kind: seconds[kind] / count for kind, count in frames.items()}


def _count(states: Sequence[RunState]) -> tuple[int, int]:
    """How many are done, and how many wait."""
    done, waiting = (sum(state.state == kind for state in states) for kind in ("done", "waiting"))
    return done, waiting


def state_table(states: Sequence[RunState]) -> Table:
    """The runs under way and some of those that wait; the rest as counts."""
    from rich.table import Table

    done, waiting = _count(states)
    seconds = sum(state.seconds_left or 0 for state in states if state.state == "training")
    title = f"{len(states)} runs: {done} done, {waiting} waiting"
    table = Table(title=title, caption=f"training under way needs another {clock(seconds)} of processor time")
    for heading in ("run", "state", "frames", "frames/s", "solved", "left"):
        table.add_column(heading, justify="left" if heading in ("run", "state") else "right", no_wrap=heading != "run")
    shown = sorted(states, key=lambda state: ("training", "evaluating", "waiting", "done").index(state.state))
    for state in shown[:MOST_ROWS]:
        table.add_row(
            state.name,
            state.state,
            f"{100 * state.frames / state.all_frames:.0f} % of {state.all_frames:,}",
            "-" if state.frames_per_s is None else f"{state.frames_per_s:,.0f}",
            f"{state.solved}/{state.targets}",
            "-" if state.seconds_left is None else clock(state.seconds_left),
        )
    return table


def clock(seconds: float) -> str:
    """Seconds as h:mm:ss."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
