"""What the tests of pages and figures share: a page's parsed form, and the figures as drawn."""

from __future__ import annotations

from html.parser import HTMLParser
from typing import Any

import pytest
from matplotlib.figure import Figure

VOID = {"meta", "img"}


class PageParts(HTMLParser):
    """Tags and text of a page; fails where tags are not balanced."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(source)
        self.close()
        assert self.open == []

    @property
    def text(self) -> str:
        """All text that is shown, a piece a line."""
        return "\n".join(self.texts)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """The attributes of each such tag."""
        return [attributes for name, attributes in self.seen if name == tag]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] != "style" and data.strip():
            self.texts.append(data.strip())


@pytest.fixture
def page_parts() -> type[PageParts]:
    """Parses a page's source."""
    return PageParts


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Receives every matplotlib figure that is saved, in order."""
    figures: list[Figure] = []
    plain = Figure.savefig

    def watched(figure: Figure, *arguments: Any, **named: Any) -> None:
        plain(figure, *arguments, **named)
        figures.append(figure)

    monkeypatch.setattr(Figure, "savefig", watched)
    return figures
