"""Evaluations as tables for people: the same rows for the terminal, Markdown and the demo's page.

A target that was not reached in every episode is marked, and so is every row of means it is part of.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

from clearway.evaluation.optimum import OPTIMUM, SOFT_FIXED_POINT
from clearway.evaluation.summary import Evaluation, Result
from clearway.markdown import table_lines
from clearway.terminal import noted

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

Level = Literal["average", "scenes", "targets"]
Width = Literal["terminal", "page", "all"]
"""How many columns there is room for; what a narrower table has, a wider one has too."""
WIDTHS: tuple[Width, ...] = get_args(Width)
MARK = "✗"
REFERENCES = {
    OPTIMUM: "the exact best policy under that reward (discount 0.99), ties taken alike",
    SOFT_FIXED_POINT: "where the published loss comes to rest, exactly (entropy weight 0.01, rewards clipped)",
}


@dataclass(frozen=True)
class Cell:
    """A figure as text.

    Attributes:
        text: the figure.
        below: what belongs under it or behind it: a figure's interval, an agent's way of acting.
        failed: there is a failed target in it.
    """

    text: str
    below: str = ""
    failed: bool = False


@dataclass(frozen=True)
class TableText:
    """A table as text: headings, rows of cells, and the notes that belong under it."""

    headings: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Column:
    heading: str
    metric: str
    digits: int
    percent: bool = False
    least: Width = "all"

    def cell(self, result: Result, ranges: bool) -> Cell:
        """The figure of this column. Large figures lose decimals, the ends of the interval keep as many."""
        scale = 100 if self.percent else 1
        value = scale * result.values[self.metric]
        low, high = (scale * end for end in result.intervals[self.metric])
        digits = max(0, self.digits - (value >= 10) - (value >= 100))
        return Cell(f"{value:.{digits}f}", f"{low:.{digits}f}–{high:.{digits}f}" if ranges else "")


COLUMNS = (
    _Column("steps", "steps", 2, least="terminal"),
    _Column("× shortest", "path_ratio", 2),
    _Column("collisions", "collisions", 3, least="terminal"),
    _Column("per 100 steps", "collisions_per_100_steps", 2),
    _Column("no collision %", "collision_free", 2, percent=True),
    _Column("sc %", "sc", 2, percent=True, least="terminal"),
    _Column("sc 4× %", "sc_4x", 2, percent=True, least="page"),
    _Column("SPL %", "spl", 2, percent=True, least="terminal"),
    _Column("collision-free SPL %", "collision_free_spl", 2, percent=True),
    _Column("in collision zone %", "share_collision", 2, percent=True),
    _Column("looped %", "looped", 2, percent=True),
)


def table_text(
    evaluations: Sequence[Evaluation], level: Level = "average", *, width: Width = "all", ranges: bool = True
) -> TableText:
    """The rows of a table of one or more evaluations.

    Args:
        evaluations: at least one.
        level: one row an evaluation ("average"), or one for each of its "scenes" or "targets"; a single scene is the
            average.
        width: which columns.
        ranges: the notes say what ranges are.
    """
    assert evaluations, "a table needs at least one evaluation"
    level = _level(evaluations, level)
    columns = [column for column in COLUMNS if WIDTHS.index(column.least) <= WIDTHS.index(width)]
    where = () if level == "average" else ("scene",)
    headings = (*where, "agent", "solved", *(column.heading for column in columns))
    names = [evaluation.agent for evaluation in evaluations]
    rows = tuple(
        (
            *_place(result, level),
            Cell(evaluation.agent, evaluation.protocol.action_selection if names.count(evaluation.agent) > 1 else ""),
            _solved(result),
            *(column.cell(result, _has_ranges(evaluation)) for column in columns),
        )
        for result, evaluation in _results(evaluations, level)
    )
    return TableText(headings, rows, tuple(_notes(evaluations, ranges and _has_ranges(evaluations[0]))))


def markdown_table(evaluations: Sequence[Evaluation], level: Level = "average", *, width: Width = "all") -> str:
    """The table in Markdown, its notes under it."""
    table = table_text(evaluations, level, width=width)
    lines = table_lines(table.headings, [[_one_line(cell) for cell in row] for row in table.rows])
    return "\n".join([*lines, "", *(f"{note}  " for note in table.notes)]) + "\n"


def rich_tables(
    evaluations: Sequence[Evaluation], levels: Sequence[Level], *, every: bool = True, rest: str = "--all"
) -> Group:
    """The main figures for the terminal, a table a level: intervals dim, failures in red, notes at the end.

    Args:
        evaluations: that of the agent first.
        levels: of the tables.
        every: show all evaluations. Else each agent by its first way of acting, without exact optima.
        rest: how to see those that are not shown.
    """
    from rich.console import Group

    shown = evaluations if every else main_rows(evaluations)
    with_ranges = [_level(evaluations, level) == "average" for level in levels]
    contents = [table_text(shown, level, width="terminal", ranges=any(with_ranges)) for level in levels]
    *tables, last = (_rich(content, ranges) for content, ranges in zip(contents, with_ranges, strict=True))
    left = [f"{told}: {rest}."] if (told := _left_out(evaluations, shown)) else []
    return Group(*tables, noted(last, [*contents[-1].notes, *left]))


def main_rows(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Each agent by its first way of acting, without the exact optima."""
    way = evaluations[0].protocol.action_selection
    return [one for one in evaluations if one.protocol.action_selection == way and not _is_exact(one)]


def _is_exact(evaluation: Evaluation) -> bool:
    return evaluation.agent.startswith(tuple(f"{name} (" for name in REFERENCES))


def _left_out(evaluations: Sequence[Evaluation], shown: Sequence[Evaluation]) -> str:
    """How many rows are not shown, and of what; empty where all are."""
    count = len(evaluations) - len(shown)
    exact = sum(map(_is_exact, evaluations))
    kinds = ["other ways of acting"] * (count > exact) + ["exact optima"] * (exact > 0)
    return f"{count} more row{'s' * (count > 1)}, of {' and '.join(kinds)}" if count else ""


def _rich(content: TableText, intervals: bool) -> Table:
    """The table for the terminal; without intervals there is room for a column more."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    first_figure = content.headings.index("solved")
    for index, heading in enumerate(content.headings):
        if index < first_figure:
            longest = max(len(word) for row in content.rows for word in row[index].text.split())
            table.add_column(heading, overflow="fold", min_width=longest)
        else:
            table.add_column(heading, justify="right", no_wrap=True)
    for row in content.rows:
        texts = []
        for index, cell in enumerate(row):
            text = Text(cell.text, style="bold red" if cell.failed else "")
            if cell.below and (intervals or index < first_figure):
                text.append(f"\n{cell.below.replace('-', ' ')}", style="dim")  # folded between words, not within
            texts.append(text)
        table.add_row(*texts)
    return table


def _has_ranges(evaluation: Evaluation) -> bool:
    """One episode a target says nothing of others."""
    return evaluation.protocol.episodes_per_target > 1


def _results(evaluations: Sequence[Evaluation], level: Level) -> list[tuple[Result, Evaluation]]:
    """Results place after place, within a place agent after agent."""
    if level == "average":
        return [(evaluation.average, evaluation) for evaluation in evaluations]
    by_agent = [evaluation.scenes if level == "scenes" else evaluation.targets for evaluation in evaluations]
    return [pair for place in zip(*by_agent, strict=True) for pair in zip(place, evaluations, strict=True)]


def _level(evaluations: Sequence[Evaluation], level: Level) -> Level:
    """The level of a table: with a single scene, its row is the average."""
    return "average" if level == "scenes" and len(evaluations[0].scenes) == 1 else level


def _place(result: Result, level: Level) -> tuple[Cell, ...]:
    if level == "average":
        return ()
    return (Cell(result.scene, "" if result.target is None else f"target {result.target}"),)


def _solved(result: Result) -> Cell:
    """How many targets are solved; for a single target the share of its episodes."""
    failed = bool(result.failed_targets)
    if result.target is None:
        text = f"{result.solved_targets}/{result.target_count}"
    else:
        text = f"{math.floor(1000 * result.values['success']) / 10:g} %"  # rounded down: 100 means all
    return Cell(f"{MARK} {text}" if failed else text, failed=failed)


def _notes(evaluations: Sequence[Evaluation], ranges: bool) -> list[str]:
    protocol = evaluations[0].protocol
    encoders = ", ".join(dict.fromkeys(evaluation.encoder for evaluation in evaluations))
    count = protocol.episodes_per_target
    notes = [
        f"Encoder: {encoders}.",
        *dict.fromkeys(f"{found.agent}: {found.trained}." for found in evaluations if found.trained),
        f"{count} episode{'s' * (count > 1)} a target from random starts, at most {protocol.step_limit:,} "
        f"steps, seed {protocol.seed}.{' Ranges: 95 % bootstrap intervals over episodes.' if ranges else ''}",
    ]
    for name, meaning in REFERENCES.items():
        if any(evaluation.agent.startswith(f"{name} (") for evaluation in evaluations):
            notes.append(f"{name.capitalize()}: {meaning}.")
    if any(evaluation.average.failed_targets for evaluation in evaluations):
        notes.append(
            f"{MARK} Not every episode reached its target; a failed episode counts with all its "
            f"{protocol.step_limit:,} steps in every mean it is part of."
        )
    return notes


def _one_line(cell: Cell) -> str:
    text = f"**{cell.text}**" if cell.failed else cell.text
    return f"{text} ({cell.below})" if cell.below else text
