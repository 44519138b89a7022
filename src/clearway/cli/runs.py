"""`clearway runs list|compare|clean`."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from clearway.cli.arguments import check_ending
from clearway.cli.console import print_json, say, stdout_console
from clearway.errors import ClearwayError, printable

if TYPE_CHECKING:
    from clearway.learn.runs import RunSummary

CURVES_AT_MOST = 8  # runs in one picture
HEADINGS = ("run", "reward", "algorithm", "seed", "frames", "solved", "success", "steps", "collisions")
CAPTION = "success, steps, collisions: of training's episodes, in its latest stretch"
INDENT = 2  # of a run's figures below its folder
BROKEN = HEADINGS[1:].index("reward"), HEADINGS[1:].index("frames")


@dataclass(frozen=True)
class ListRuns:
    """List the runs of a folder, and what came of them.

    Example: clearway runs list runs
    """

    folder: Annotated[Path, tyro.conf.Positional] = Path("runs")
    """The folder that holds them."""
    json: bool = False
    """Print JSON."""

    def run(self) -> None:
        """Print a row a run; what cannot be read is said, and left out."""
        from clearway.learn.runs import find_runs, run_summary

        found: list[RunSummary] = []
        for folder in find_runs(self.folder):
            try:
                found.append(run_summary(folder))
            except ClearwayError as error:
                say(f"left out: {error}")
        if not found:
            raise ClearwayError(f"{self.folder}: holds no runs. Name another folder, or train: clearway train")
        if self.json:
            print_json([summary.to_json() for summary in found])
            return
        _print_runs(found)


@dataclass(frozen=True)
class CompareRuns:
    """Compare runs: what came of them, and where their settings differ; with --curves how they learnt.

    Example: clearway runs compare runs/a runs/b --curves curves.png
    """

    folders: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Run folders, two or more."""
    curves: Path | None = None
    """Draw the learning curves of all of them here (PNG); by default none are drawn."""
    json: bool = False
    """Print JSON."""

    def run(self) -> None:
        """Print and draw."""
        from clearway.learn.run_folder import RunFolder
        from clearway.learn.runs import differences, run_summary

        if len(set(self.folders)) < 2:
            raise ClearwayError("runs compare: expected two run folders or more. Name another one")
        check_ending(".png", curves=self.curves)
        if self.curves and len(self.folders) > CURVES_AT_MOST:
            raise ClearwayError(f"--curves: draws {CURVES_AT_MOST} runs at most. Name fewer")
        folders = [RunFolder(path) for path in dict.fromkeys(self.folders)]
        found = [run_summary(folder) for folder in folders]
        differ = differences([summary.record for summary in found])
        if self.curves:
            from clearway.viz.curves import draw_curves

            draw_curves({str(folder.path): folder.metrics() for folder in folders}, self.curves)
            say(f"{self.curves}: learning curves")
        if self.json:
            print_json({"runs": [summary.to_json() for summary in found], "differences": differ})
            return
        _print_runs(found)
        _print_differences([str(summary.path) for summary in found], differ)


@dataclass(frozen=True)
class CleanRuns:
    """Say which old checkpoints of runs could go, and with --yes remove them. The newest of each run stays.

    Example: clearway runs clean runs
    """

    folder: Annotated[Path, tyro.conf.Positional] = Path("runs")
    """The folder that holds the runs."""
    yes: bool = False
    """Remove them; without it they are only listed."""

    def run(self) -> None:
        """List, and remove."""
        from clearway.learn.runs import find_runs, old_checkpoints, size_of

        total = count = 0
        for folder in find_runs(self.folder):
            try:
                if not old_checkpoints(folder):
                    continue
                with folder.held() if self.yes else nullcontext():  # none that is being written; looking leaves no lock
                    for path in old_checkpoints(folder):
                        size = size_of(path)
                        if self.yes:
                            shutil.rmtree(path)
                        print(f"{printable(str(path))}  {_megabytes(size)}")
                        total, count = total + size, count + 1
            except ClearwayError as error:
                say(f"left alone: {error}")
        told = f"{count} old checkpoint{'s' * (count != 1)}, {_megabytes(total)}"
        if self.yes:
            say(f"removed {told}")
        else:
            say(told + (f". Remove: clearway runs clean {self.folder} --yes" if count else ""))


@dataclass(frozen=True)
class Runs:
    """Run folders: list them, compare them, remove old checkpoints.

    Example: clearway runs list runs
    """

    command: (
        Annotated[ListRuns, tyro.conf.subcommand("list")]
        | Annotated[CompareRuns, tyro.conf.subcommand("compare")]
        | Annotated[CleanRuns, tyro.conf.subcommand("clean")]
    )

    def run(self) -> None:
        """Run the chosen command."""
        self.command.run()


def _print_runs(runs: Sequence[RunSummary]) -> None:
    """Print a row a run; where the rows are too wide, each run's folder on a line of its own, its figures below it."""
    rows = [_row(summary) for summary in runs]
    if _width([max(map(len, column)) for column in zip(HEADINGS, *rows, strict=True)]) <= stdout_console().width:
        _print_table(HEADINGS, rows)
        _print_whole(CAPTION)
        return
    widths = _widths_below([HEADINGS[1:], *(row[1:] for row in rows)])
    for row in (HEADINGS, *rows):
        _print_whole(row[0])
        _print_below(row[1:], widths)
    _print_whole(CAPTION)


def _widths_below(rows: Sequence[Sequence[str]]) -> list[int]:
    """Of columns below a name; rewards, then frames, are broken between words where there is too little room."""
    columns = list(zip(*rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    over = INDENT + _width(widths) - stdout_console().width
    for place in BROKEN:
        longest = max(len(word) for cell in columns[place] for word in cell.split())
        spared = max(0, min(over, widths[place] - longest))
        widths[place] -= spared
        over -= spared
    return widths


def _print_below(cells: Sequence[str], widths: Sequence[int]) -> None:
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, padding=(0, 1, 0, 0), show_header=False)
    for width in widths:
        table.add_column(width=width)
    table.add_row(*(Text(printable(cell)) for cell in cells))
    stdout_console().print(Padding(table, (0, 0, 0, INDENT)))


def _print_differences(names: Sequence[str], differ: Mapping[str, Sequence[str]]) -> None:
    """Print a column a run, under its folder; where these are too wide, under numbers, and the folders first."""
    first = max(map(len, ("differs in", *differ)))
    if differ and _width([first, *map(len, names)]) > stdout_console().width:
        for number, name in enumerate(names, 1):
            _print_whole(f"{number}  {name}")
        names = [str(number) for number in range(1, len(names) + 1)]
    _print_table(["differs in", *names], [[name, *values] for name, values in differ.items()])


def _width(columns: Sequence[int]) -> int:
    return sum(columns) + len(columns)


def _print_whole(text: str) -> None:
    """Print a line that is never broken, so that a name in it can be copied."""
    stdout_console().print(printable(text), soft_wrap=True, highlight=False)


def _row(summary: RunSummary) -> list[str]:
    """A run's cells: frames as far as it has come, "of" how many where there are more to come."""
    all_frames, figures = summary.record.learner.frames, summary.figures
    of = f" of {all_frames:,}" if summary.frames < all_frames else ""
    return [
        str(summary.path),
        summary.record.reward.name,
        summary.record.learner.algorithm,
        str(summary.record.seed),
        f"{summary.frames:,}{of}",
        f"{summary.solved} of {summary.target_count}",
        *(f"{figures[name]:.3g}" if name in figures else "-" for name in ("success", "steps", "collisions")),
    ]


def _print_table(names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich.table import Table
    from rich.text import Text

    if not rows:
        return
    table = Table(box=None, padding=(0, 1, 0, 0), header_style="bold")
    for name in names:
        table.add_column(printable(name), overflow="fold")
    for row in rows:
        table.add_row(*(Text(printable(cell)) for cell in row))
    stdout_console().print(table)


def _megabytes(size: int) -> str:
    return f"{size / 1e6:,.1f} MB"
