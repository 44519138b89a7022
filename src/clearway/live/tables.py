"""Live results as tables for people: the terminal and Markdown show the same rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from clearway.live.episodes import SUCCESS_DEG, SUCCESS_M, LiveProtocol
from clearway.live.report import Figures, LiveResult

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class _Column:
    heading: str
    metric: str
    digits: int
    scale: float = 1

    def cell(self, figures: Figures) -> tuple[str, str]:
        """The figure and its interval."""
        value, low, high = (
            f"{round(self.scale * number, self.digits) + 0.0:.{self.digits}f}"  # + 0.0: no "-0.0"
            for number in (figures.values[self.metric], *figures.intervals[self.metric])
        )
        return value, f"{low} to {high}" if low.startswith("-") else f"{low}–{high}"


COLUMNS = (
    _Column("success %", "success", 0, 100),
    _Column("steps", "steps", 1),
    _Column("contacts", "contacts", 2),
    _Column("least clearance cm", "min_clearance_m", 1, 100),
    _Column("mean clearance cm", "mean_clearance_m", 1, 100),
    _Column("time within 10 cm %", "share_within_10cm", 0, 100),
    _Column("time within 30 cm %", "share_within_30cm", 0, 100),
)
COMPARED = (
    _Column("success, points", "success", 0, 100),
    _Column("contacts", "contacts", 2),
    _Column("least clearance cm", "min_clearance_m", 1, 100),
    _Column("mean clearance cm", "mean_clearance_m", 1, 100),
    _Column("time within 10 cm, points", "share_within_10cm", 0, 100),
    _Column("time within 30 cm, points", "share_within_30cm", 0, 100),
)
LARGER = _Column("P(larger least clearance)", "probability_of_larger_clearance", 2)

Rows = list[tuple[str, str, list[tuple[str, str]]]]


def agent_rows(results: Sequence[LiveResult]) -> Rows:
    """Setting, agent and cells (figure, interval) of `COLUMNS`."""
    return [
        (result.label, name, [column.cell(figures) for column in COLUMNS])
        for result in results
        for name, figures in result.agents.items()
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


def notes(protocol: LiveProtocol, encoder: str) -> list[str]:
    """What belongs under the tables."""
    return [
        f"Encoder: {encoder}. Actions {protocol.selection}. {protocol.episodes_per_target} episodes a target from the "
        f"starts of the grid's evaluation, at most {protocol.step_cap:,} steps, seed {protocol.seed}.",
        f"Success: within {100 * SUCCESS_M:g} cm and {SUCCESS_DEG:g}° of the target's pose. Ranges: 95 % bootstrap "
        "intervals over episodes; differences are paired by episode.",
    ]


def markdown_tables(results: Sequence[LiveResult], protocol: LiveProtocol, encoder: str) -> str:
    """Both tables in Markdown, notes under them."""
    headings = ["setting", "agent"]
    lines = _markdown([*headings, *(column.heading for column in COLUMNS)], agent_rows(results))
    if compared := compared_rows(results):
        lines += ["", *_markdown([*headings, *(column.heading for column in (*COMPARED, LARGER))], compared)]
    return "\n".join([*lines, "", *(f"{note}  " for note in notes(protocol, encoder))]) + "\n"


def _markdown(headings: Sequence[str], rows: Rows) -> list[str]:
    lines = [_pipes(headings), _pipes(["---"] * len(headings))]
    return lines + [
        _pipes([label, name, *(f"{value} ({ends})" for value, ends in cells)]) for label, name, cells in rows
    ]


def _pipes(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def rich_tables(results: Sequence[LiveResult], protocol: LiveProtocol, encoder: str) -> list[Table]:
    """Both tables for the terminal, intervals dim below the figures, notes as the last one's caption."""
    tables = [_rich([column.heading for column in COLUMNS], agent_rows(results))]
    if compared := compared_rows(results):
        tables.append(_rich([column.heading for column in (*COMPARED, LARGER)], compared))
    tables[-1].caption = "\n".join(notes(protocol, encoder))
    return tables


def _rich(headings: Sequence[str], rows: Rows) -> Table:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), caption_justify="left")
    for heading in ("setting", "agent"):
        table.add_column(heading)
    for heading in headings:
        table.add_column(heading, justify="right")
    for label, name, cells in rows:
        texts = [Text(value).append(f"\n{ends}", style="dim") for value, ends in cells]
        table.add_row(label, name, *texts)
    return table
