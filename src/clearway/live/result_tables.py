"""Live results as tables for people: the terminal and Markdown show the same rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from clearway.live.episodes import SUCCESS_DEG
from clearway.live.results import Figures, LiveReport, LiveResult
from clearway.live.walker import SUCCESS_M
from clearway.markdown import table_lines
from clearway.terminal import noted

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text


@dataclass(frozen=True)
class _Column:
    heading: str
    metric: str
    digits: int
    scale: float = 1
    short: str = ""
    """Heading where there is little room; the heading itself by default."""

    def cell(self, figures: Figures) -> tuple[str, str]:
        """The figure and its interval; a dash alone where there is no such figure."""
        if self.metric not in figures.values:
            return "–", ""
        value, low, high = (
            f"{round(self.scale * number, self.digits) + 0.0:.{self.digits}f}"  # + 0.0: no "-0.0"
            for number in (figures.values[self.metric], *figures.intervals[self.metric])
        )
        return value, f"{low} to {high}" if low.startswith("-") else f"{low}–{high}"


COLUMNS = (
    _Column("success %", "success", 0, 100, "success\n%"),
    _Column("steps", "steps", 1),
    _Column("contacts", "contacts", 2),
    _Column("least clearance cm", "min_clearance_m", 1, 100, "least\ncm"),
    _Column("mean clearance cm", "mean_clearance_m", 1, 100, "mean\ncm"),
    _Column("time within 10 cm %", "share_within_10cm", 0, 100, "≤10 cm\n%"),
    _Column("time within 30 cm %", "share_within_30cm", 0, 100, "≤30 cm\n%"),
)
COMPARED = (
    _Column("success, points", "success", 0, 100, "success"),
    _Column("contacts", "contacts", 2),
    _Column("least clearance cm", "min_clearance_m", 1, 100, "least\ncm"),
    _Column("mean clearance cm", "mean_clearance_m", 1, 100, "mean\ncm"),
    _Column("time within 10 cm, points", "share_within_10cm", 0, 100, "≤10 cm"),
    _Column("time within 30 cm, points", "share_within_30cm", 0, 100, "≤30 cm"),
)
LARGER = _Column("P(larger least clearance)", "probability_of_larger_clearance", 2, 1, "P\n(larger)")

ON_GRID = "on the grid"

Rows = list[tuple[str, str, list[tuple[str, str]]]]


def agent_rows(report: LiveReport) -> Rows:
    """Setting, agent and cells (figure, interval) of `COLUMNS`; first of all on the grid."""
    settings = [(ON_GRID, report.grid), *((result.label, result.agents) for result in report.results)]
    return [
        (label, name, [column.cell(figures) for column in COLUMNS])
        for label, agents in settings
        for name, figures in agents.items()
    ]


def compared_rows(results: Sequence[LiveResult]) -> Rows:
    """Setting, "second less first" and cells of `COMPARED` and `LARGER`; none where there is one agent."""
    rows: Rows = []
    for result in results:
        found = result.comparison
        if found is not None:
            cells = [column.cell(found.differences) for column in COMPARED]
            cells.append(LARGER.cell(found.larger_clearance))
            rows.append((result.label, f"{found.second} less {found.first}", cells))
    return rows


def notes(report: LiveReport) -> list[str]:
    """What belongs under the tables."""
    protocol = report.protocol
    count = protocol.episodes_per_target
    compared = " Differences are paired by episode." if any(result.comparison for result in report.results) else ""
    return [
        f"Encoder: {report.encoder}. Actions {protocol.selection}. {count} episode{'s' * (count > 1)} a target "
        f"from the starts of the grid's evaluation, at most {protocol.step_limit:,} steps, seed {protocol.seed}.",
        f"Success: within {100 * SUCCESS_M:g} cm, at most half a cell, and {SUCCESS_DEG:g}° of the target's pose. "
        f"Ranges: 95 % bootstrap intervals over episodes.{compared} None: nothing is perturbed.",
        f"{ON_GRID.capitalize()}: the same agents, targets, starts and number of episodes on the scene's grid; success "
        "is the target's very pose, a contact a blocked move, and there is no clearance.",
    ]


def markdown_tables(report: LiveReport) -> str:
    """Both tables in Markdown, notes under them."""
    headings = ["setting", "agent"]
    lines = _markdown([*headings, *(column.heading for column in COLUMNS)], agent_rows(report))
    if compared := compared_rows(report.results):
        lines += ["", *_markdown([*headings, *(column.heading for column in (*COMPARED, LARGER))], compared)]
    return "\n".join([*lines, "", *(f"{note}  " for note in notes(report))]) + "\n"


def _markdown(headings: Sequence[str], rows: Rows) -> list[str]:
    return table_lines(
        headings,
        [
            [label, name, *(f"{value} ({ends})" if ends else value for value, ends in cells)]
            for label, name, cells in rows
        ],
    )


LABEL_WIDTH = 16
TERMINAL_NOTE = "Least and mean: clearance. ≤10 cm, ≤30 cm: share of the time that near."
COMPARED_NOTE = "P(larger): probability of the larger least clearance."


def rich_tables(report: LiveReport) -> Group:
    """Both tables for a terminal of 80 columns, intervals dim below the figures, notes below the last."""
    from rich.console import Group

    of_agents = _rich("", COLUMNS)
    rows = agent_rows(report)
    for number, (label, name, cells) in enumerate(rows):
        if not number or rows[number - 1][0] != label:
            of_agents.add_row(label, style="bold")
        of_agents.add_row(f" {name}", *_with_intervals(cells))
    tables, told = [of_agents], TERMINAL_NOTE
    if compared := compared_rows(report.results):
        tables.append(_rich(f"\n{compared[0][1]}, shares in points", (*COMPARED, LARGER)))
        for label, _, cells in compared:
            tables[-1].add_row(label, *_with_intervals(cells))
        told += f" {COMPARED_NOTE}"
    return Group(*tables[:-1], noted(tables[-1], ["", told, *notes(report)]))


def _rich(title: str, columns: Sequence[_Column]) -> Table:
    from rich.table import Table

    table = Table(title=title, box=None, padding=(0, 1, 0, 0), pad_edge=False, title_justify="left")
    table.add_column("", width=LABEL_WIDTH)
    for column in columns:
        table.add_column(column.short or column.heading, justify="right")
    return table


def _with_intervals(cells: Sequence[tuple[str, str]]) -> list[Text]:
    from rich.text import Text

    return [Text(value).append(f"\n{ends}" if ends else "", style="dim") for value, ends in cells]
