"""The demo's page: one `index.html` beside its pictures that shows what was built, learnt and measured."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from urllib.parse import quote

from clearway.evaluate.tables import Cell, TableText
from clearway.files import written_whole
from clearway.viz.page_style import CSS

PAGE_FILE = "index.html"


@dataclass(frozen=True)
class Picture:
    """A picture of the page.

    Attributes:
        file: path relative to the page's folder, with forward slashes.
        caption: stands below; also what screen readers say, unless `alt` is given.
        alt: what the picture shows, for those who do not see it.
    """

    file: str
    caption: str
    alt: str = ""


@dataclass(frozen=True)
class KeyFigure:
    """One figure of the summary: what it is, its value, and what belongs beside it (an interval, a reference)."""

    name: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class Page:
    """What the page says; everything is plain text.

    Attributes:
        title: the headline.
        sentence: what this is, in one sentence.
        key_figures: the summary.
        maps: the room from above with the agents' ways.
        rooms: views of the room.
        table: agents and references.
        more_tables: folded away, by heading.
        contact_sheets: what the agents saw.
        curves: how they learnt.
        commands: that made this page.
        facts: encoder, seeds, versions, hardware and the like, by name.
    """

    title: str
    sentence: str
    table: TableText
    key_figures: Sequence[KeyFigure] = ()
    maps: Sequence[Picture] = ()
    rooms: Sequence[Picture] = ()
    more_tables: Mapping[str, TableText] = field(default_factory=dict)
    contact_sheets: Sequence[Picture] = ()
    curves: Sequence[Picture] = ()
    commands: Sequence[str] = ()
    facts: Mapping[str, str] = field(default_factory=dict)


def write_page(folder: Path, page: Page) -> Path:
    """Write the page into a folder that holds its pictures, and give back its path."""
    path = folder / PAGE_FILE
    with written_whole(path) as part:
        part.write_text(_document(page), encoding="utf-8")
    return path


def _document(page: Page) -> str:
    sections = [
        _section("The room", "What the agent sees at some of its poses.", _gallery(page.rooms, "small")),
        _section(
            "The way",
            "The room from above. In the red zone a move is blocked, the amber zone leads there.",
            _gallery(page.maps, "large" if len(page.maps) > 1 else "whole"),
        ),
        _section("The figures", "Each agent beside a random walk and the shortest path.", _tables(page)),
        _section(
            "What the agents saw",
            "One episode each, view by view. The first picture is the target; frames show the zone.",
            _gallery(page.contact_sheets, "whole"),
        ),
        _section("Learning", "Figures of the training episodes.", _gallery(page.curves, "whole")),
        _section("How this was made", "", _commands(page.commands) + _facts(page.facts)),
    ]
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            f"<title>{escape(page.title)} · clearway</title>",
            f"<style>{CSS}</style>",
            "</head>",
            "<body>",
            '<header class="top">',
            '<p class="mark">clearway</p>',
            f"<h1>{escape(page.title)}</h1>",
            f'<p class="lead">{escape(page.sentence)}</p>',
            _key_figures(page.key_figures),
            "</header>",
            "<main>",
            *filter(None, sections),
            "</main>",
            "</body>",
            "</html>",
            "",
        ]
    )


def _section(heading: str, text: str, content: str) -> str:
    """A section; nothing where it has no content."""
    if not content:
        return ""
    paragraph = f"<p>{escape(text)}</p>" if text else ""
    return f"<section>\n<h2>{escape(heading)}</h2>\n{paragraph}\n{content}\n</section>"


def _key_figures(figures: Sequence[KeyFigure]) -> str:
    if not figures:
        return ""
    cards = []
    for figure in figures:
        note = f"<dd>{escape(figure.note)}</dd>" if figure.note else ""
        cards.append(f"<div><dt>{escape(figure.name)}</dt><dd>{escape(figure.value)}</dd>{note}</div>")
    return '<dl class="figures">\n' + "\n".join(cards) + "\n</dl>"


def _gallery(pictures: Sequence[Picture], layout: str) -> str:
    if not pictures:
        return ""
    return f'<div class="gallery {layout}">\n' + "\n".join(_figure(picture) for picture in pictures) + "\n</div>"


def _figure(picture: Picture) -> str:
    source = escape(quote(picture.file))
    alt = escape(picture.alt or picture.caption)
    image = f'<a href="{source}"><img src="{source}" alt="{alt}"></a>'
    return f"<figure>{image}<figcaption>{escape(picture.caption)}</figcaption></figure>"


def _tables(page: Page) -> str:
    folded = [
        f"<details><summary>{escape(heading)}</summary>\n{_table(table)}\n</details>"
        for heading, table in page.more_tables.items()
    ]
    notes = "".join(f"<li>{escape(note)}</li>" for note in page.table.notes)
    return "\n".join([_table(page.table), f'<ul class="notes">{notes}</ul>', *folded])


def _table(table: TableText) -> str:
    headings = "".join(f'<th scope="col">{escape(heading)}</th>' for heading in table.headings)
    rows = "\n".join(f"<tr>{_row(row)}</tr>" for row in table.rows)
    head, body = f"<thead><tr>{headings}</tr></thead>", f"<tbody>\n{rows}\n</tbody>"
    return f'<div class="scroll" tabindex="0"><table>\n{head}\n{body}</table></div>'


def _row(cells: Iterable[Cell]) -> str:
    first, *others = cells
    return f'<th scope="row">{_cell_text(first)}</th>' + "".join(_cell(cell) for cell in others)


def _cell(cell: Cell) -> str:
    marked = ' class="failed"' if cell.failed else ""
    return f"<td{marked}>{_cell_text(cell)}</td>"


def _cell_text(cell: Cell) -> str:
    below = f"<small>{escape(cell.below)}</small>" if cell.below else ""
    return f"{escape(cell.text)}{below}"


def _commands(commands: Sequence[str]) -> str:
    return f"<pre>{escape(chr(10).join(commands))}</pre>\n" if commands else ""


def _facts(facts: Mapping[str, str]) -> str:
    if not facts:
        return ""
    pairs = "\n".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in facts.items())
    return f'<dl class="facts">\n{pairs}\n</dl>'
