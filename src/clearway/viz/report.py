"""A report of sections: one page that holds everything, Markdown, a CSV for each table, and JSON.

report.html    self-contained: style and pictures are inside
report.md      the same in Markdown, pictures beside it
report.json    everything as data
tables/        a CSV for each table
figures/       a PNG for each figure
"""

from __future__ import annotations

import base64
import csv
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from clearway.experiments.in_short import in_short, is_judged
from clearway.experiments.section import Claim, ReportTable, Section, Value
from clearway.files import json_text, read_json, written_whole
from clearway.markdown import table_lines
from clearway.regular_files import read_bytes
from clearway.scenes.scene import Scene
from clearway.viz.html import rendered_html
from clearway.viz.report_figures import draw_report_figure, draw_report_map

HTML, MARKDOWN, JSON, TABLES, FIGURES = "report.html", "report.md", "report.json", "tables", "figures"
LONG_TEXT = 60  # letters; a column with more is broken into lines
MAX_PICTURE_BYTES = 64 * 1024**2  # of a figure
SHOWN_ROWS = 60  # of a table in the page and in Markdown; its CSV has all
SUMMARY, VERDICTS = "summary", "claims"
WHOLE = (SUMMARY, VERDICTS)  # tables that have no CSV


def write_report(
    folder: Path,
    title: str,
    sections: Sequence[Section],
    facts: Mapping[str, str],
    warning: str,
    scenes: Sequence[Scene],
) -> Path:
    """Write all forms of the report into a folder and give back the page's path.

    Args:
        folder: receives the files.
        title: of the report.
        sections: in order.
        facts: command, seeds, versions, hardware and the like, by name.
        warning: stands at the top; empty for none.
        scenes: those of the maps.
    """
    _remove_stale(folder, sections)
    content = {"title": title, "warning": warning, "facts": dict(facts), "sections": [asdict(s) for s in sections]}
    _write_text(folder / JSON, json_text(content))  # first, so that what a killed one leaves is known to the next
    for section in sections:
        for table in section.tables:
            _write_csv(folder / TABLES / f"{table.name}.csv", table)
        for figure in section.figures:
            draw_report_figure(figure, folder / FIGURES / f"{figure.name}.png")
        for shown in section.maps:
            draw_report_map(shown, scenes, folder / FIGURES / f"{shown.name}.png")
    _write_text(folder / MARKDOWN, _markdown(title, sections, facts, warning))
    _write_text(folder / HTML, _page(folder, title, sections, facts, warning))
    return folder / HTML


def _remove_stale(folder: Path, sections: Sequence[Section]) -> None:
    """Remove the tables and figures of the report that lies here, where the new one has none of that name."""
    try:
        earlier = read_json(folder / JSON)["sections"]
        names = {(TABLES, f"{table['name']}.csv") for section in earlier for table in section["tables"]}
        names |= {(FIGURES, f"{f['name']}.png") for section in earlier for f in (*section["figures"], *section["maps"])}
    except (OSError, ValueError, KeyError, TypeError):  # no report, or a damaged one: nothing is known to be stale
        return
    names -= {(TABLES, f"{table.name}.csv") for section in sections for table in section.tables}
    names -= {(FIGURES, f"{figure.name}.png") for section in sections for figure in section.pictures}
    for place, name in names:
        if Path(name).name == name:  # a file may say anything; nothing outside the report's folders is touched
            (folder / place / name).unlink(missing_ok=True)


def _write_text(path: Path, text: str) -> None:
    with written_whole(path) as part:
        part.write_text(text, encoding="utf-8")


def _write_csv(path: Path, table: ReportTable) -> None:
    with written_whole(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table.headings)
        writer.writerows(table.rows)


def value_text(value: Value) -> str:
    """A value for people: figures to four significant digits, nothing for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"
    return f"{value:,}" if isinstance(value, int) else value


def _summary(sections: Sequence[Section]) -> list[ReportTable]:
    """All verdicts at a glance, the paper's claims apart; nothing where none is judged."""
    tables: list[ReportTable] = []
    if not is_judged(sections):
        return tables
    for title, further in (("The paper's claims at a glance", False), ("Further questions", True)):
        claims = [(claim, section.title) for section in sections for claim in section.claims]
        rows = tuple((claim.text, claim.verdict, where) for claim, where in claims if claim.further == further)
        if rows:
            tables.append(ReportTable(SUMMARY, title, ("claim", "verdict", "evidence in"), rows))
    return tables


def _verdict_rows(claims: Sequence[Claim]) -> ReportTable:
    rows = tuple((claim.text, claim.verdict, claim.evidence) for claim in claims)
    return ReportTable(VERDICTS, "Verdicts", ("claim", "verdict", "evidence"), rows)


def _shown_rows(table: ReportTable) -> Sequence[Sequence[Value]]:
    return table.rows if table.name in WHOLE else table.rows[:SHOWN_ROWS]


def _missing_text(section: Section) -> str:
    count = len(section.missing)
    return f"{count} run{'s are' if count > 1 else ' is'} not complete yet; the tables hold what is." if count else ""


def _table_notes(table: ReportTable) -> tuple[str, ...]:
    """Where the rows are that are not shown, then the table's own notes."""
    more = len(table.rows) - len(_shown_rows(table))
    rest = f"{more:,} more rows in {TABLES}/{table.name}.csv" if more > 0 else ""
    return tuple(note for note in (rest, *table.notes) if note)


# ------------------------------------------------------------------------------------------------------------ Markdown


def _markdown(title: str, sections: Sequence[Section], facts: Mapping[str, str], warning: str) -> str:
    lines, judged = [f"# {title}", ""], is_judged(sections)
    lines += [f"**{warning}**", ""] if warning else []
    lines += [*(f"- {line}" for line in in_short(sections)), ""]
    for table in _summary(sections):
        lines += [f"## {table.title}", "", *_markdown_table(table)]
    for section in sections:
        lines += [f"## {section.title}", "", section.text, ""]
        missing = _missing_text(section)
        lines += [f"*{missing}*", ""] if missing else []
        if section.claims and judged:
            lines += _markdown_table(_verdict_rows(section.claims))
        for table in section.tables:
            lines += [f"### {table.title}", "", *_markdown_table(table)]
        for figure in section.pictures:
            lines += [f"![{figure.title}]({FIGURES}/{figure.name}.png)", ""]
    lines += ["## How it was made", "", *(f"- {name}: {value}" for name, value in facts.items())]
    return "\n".join(lines) + "\n"


def _markdown_table(table: ReportTable) -> list[str]:
    rows = [[value_text(value) for value in row] for row in _shown_rows(table)]
    notes = [f"{note}  " for note in _table_notes(table)]
    return [*table_lines(table.headings, rows), "", *notes, ""]


# ---------------------------------------------------------------------------------------------------------------- HTML


@dataclass(frozen=True)
class ShownTable:
    """A table of the page: all text, no more rows than are shown.

    Attributes:
        title: above it.
        headings: of the columns.
        looks: CSS classes of each column; "" for none.
        rows: as many texts each.
        notes: below it.
        folded: it shows when asked for.
    """

    title: str
    headings: tuple[str, ...]
    looks: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]
    folded: bool


def _page(folder: Path, title: str, sections: Sequence[Section], facts: Mapping[str, str], warning: str) -> str:
    return rendered_html(
        "report",
        title=title,
        warning=warning,
        in_short=in_short(sections),
        summary=[_shown(table) for table in _summary(sections)],
        sections=[_section(folder, section, is_judged(sections)) for section in sections],
        facts=facts,
    )


def _section(folder: Path, section: Section, judged: bool) -> dict[str, Any]:
    """A section as the page's template names it; without verdicts where the report judges nothing."""
    verdicts = [_verdict_rows(section.claims)] if section.claims and judged else []
    return {
        "name": section.name,
        "title": section.title,
        "text": section.text,
        "missing": _missing_text(section),
        "tables": [_shown(table) for table in (*verdicts, *section.tables)],
        "pictures": [{"title": each.title, "png": _encoded(folder, each.name)} for each in section.pictures],
    }


def _encoded(folder: Path, name: str) -> str:
    return base64.b64encode(read_bytes(folder / FIGURES / f"{name}.png", MAX_PICTURE_BYTES)).decode()


def _shown(table: ReportTable) -> ShownTable:
    return ShownTable(
        title=table.title,
        headings=table.headings,
        looks=tuple(_look([row[column] for row in table.rows]) for column in range(len(table.headings))),
        rows=tuple(tuple(map(value_text, row)) for row in _shown_rows(table)),
        notes=_table_notes(table),
        folded=table.folded,
    )


def _look(values: Sequence[Value]) -> str:
    """Columns of words stand on the left, long sentences are broken into lines; figures stay on the right."""
    texts = [value for value in values if isinstance(value, str) and any(letter.isalpha() for letter in value)]
    if not texts:
        return ""
    return "words long" if max(map(len, texts)) > LONG_TEXT else "words"
