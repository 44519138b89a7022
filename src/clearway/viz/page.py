"""The demo's page: one `index.html` beside its pictures that shows what was built, learnt and measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from clearway.evaluation.tables import TableText
from clearway.files import written_whole
from clearway.viz.html import rendered_html

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
    """One figure of the summary: what it is, its value, what belongs beside it, and whose colour it has."""

    name: str
    value: str
    note: str = ""
    colour: str = ""


@dataclass(frozen=True)
class Opening:
    """What one sees first: figures, pictures of what they mean, and what they are of."""

    figures: Sequence[KeyFigure] = ()
    pictures: Sequence[Picture] = ()
    text: str = ""


@dataclass(frozen=True)
class Page:
    """What the page says; everything is plain text.

    Attributes:
        title: the headline.
        sentence: what this is, in one sentence.
        opening: what one sees first.
        unseen: the generalist's way in a room that it has never entered, and what it saw.
        unseen_text: how that went.
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
    opening: Opening = Opening()
    unseen: Sequence[Picture] = ()
    unseen_text: str = ""
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
        part.write_text(rendered_html("demo", title=page.title, page=page), encoding="utf-8")
    return path
