from html.parser import HTMLParser

from clearway.evaluate.tables import Cell, TableText
from clearway.viz.page import KeyFigure, Page, Picture, write_page

TABLE = TableText(
    ("agent", "solved", "steps"),
    ((Cell("<b>ours</b>", "sampled"), Cell("✗ 4/5", failed=True), Cell("9.1", "8.8–9.4")),),
    ("Encoder: random & frozen.",),
)
VOID = {"meta", "img"}


class Structure(HTMLParser):
    """Checks that tags are balanced and collects links and text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict]] = []
        self.text = ""

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.text += data


def full_page() -> Page:
    return Page(
        title="Two agents & a <room>",
        sentence='They "walk".',
        table=TABLE,
        key_figures=[KeyFigure("steps", "9.1", "<9.4")],
        maps=[Picture("pictures/map 1.png", "The <way>", alt='a "map"')],
        rooms=[Picture("pictures/a.png", "State 1"), Picture("pictures/b.png", "State 2")],
        more_tables={"Every target": TABLE},
        contact_sheets=[Picture("pictures/sheet.png", "Views")],
        curves=[Picture("pictures/curves.png", "Curves")],
        commands=["clearway demo --out <dir> && echo done"],
        facts={"Hardware": "2 cores of <Some & CPU>"},
    )


def parsed(tmp_path, page: Page) -> tuple[Structure, str]:
    source = write_page(tmp_path, page).read_text(encoding="utf-8")
    structure = Structure()
    structure.feed(source)
    assert structure.open == []
    return structure, source


def test_everything_is_shown_and_nothing_is_taken_for_markup(tmp_path):
    structure, source = parsed(tmp_path, full_page())
    for text in (
        "Two agents & a <room>", 'They "walk".', "<b>ours</b>", "✗ 4/5", "8.8–9.4", "Encoder: random & frozen.",
        "<9.4", "The <way>", "Every target", "clearway demo --out <dir> && echo done", "2 cores of <Some & CPU>",
    ):  # fmt: skip
        assert text in structure.text
    assert "<b>" not in source and "<room>" not in source
    assert [a["class"] for tag, a in structure.seen if tag == "td" and "class" in a] == ["failed"] * 2


def test_pictures_are_relative_and_nothing_comes_from_elsewhere(tmp_path):
    structure, source = parsed(tmp_path, full_page())
    sources = [attrs["src"] for tag, attrs in structure.seen if tag == "img"]
    assert sources[-1] == "pictures/curves.png" and "pictures/map%201.png" in sources
    assert all(attrs.get("alt") for tag, attrs in structure.seen if tag == "img")
    assert not {"script", "link", "iframe"} & {tag for tag, _ in structure.seen}
    assert "http:" not in source and "https:" not in source and "url(" not in source
    assert "prefers-color-scheme: dark" in source


def test_a_page_without_pictures_has_no_empty_sections(tmp_path):
    structure, _ = parsed(tmp_path, Page(title="t", sentence="s", table=TABLE))
    assert [tag for tag, _ in structure.seen].count("section") == 1
