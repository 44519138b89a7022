from clearway.evaluation.tables import Cell, TableText
from clearway.viz.page import KeyFigure, Opening, Page, Picture, write_page

TABLE = TableText(
    ("agent", "solved", "steps"),
    ((Cell("<b>ours</b>", "sampled"), Cell("✗ 4/5", failed=True), Cell("9.1", "8.8–9.4")),),
    ("Encoder: random & frozen.",),
)


def full_page() -> Page:
    return Page(
        title="Two agents & a <room>",
        sentence='They "walk".',
        table=TABLE,
        opening=Opening([KeyFigure("steps", "9.1", "<9.4")]),
        maps=[Picture("pictures/map 1.png", "The <way>", alt='a "map"')],
        rooms=[Picture("pictures/a.png", "State 1"), Picture("pictures/b.png", "State 2")],
        more_tables={"Every target": TABLE},
        contact_sheets=[Picture("pictures/sheet.png", "Views")],
        curves=[Picture("pictures/curves.png", "Curves")],
        commands=["clearway demo --out <dir> && echo done", "clearway view"],
        facts={"Hardware": "2 cores of <Some & CPU>"},
    )


def written(tmp_path, page: Page) -> str:
    return write_page(tmp_path, page).read_text(encoding="utf-8")


def test_everything_is_shown_and_nothing_is_taken_for_markup(tmp_path, page_parts):
    source = written(tmp_path, full_page())
    shown = page_parts(source)
    for text in (
        "Two agents & a <room>", 'They "walk".', "<b>ours</b>", "✗ 4/5", "8.8–9.4", "Encoder: random & frozen.",
        "<9.4", "The <way>", "Every target", "clearway demo --out <dir> && echo done\nclearway view",
        "2 cores of <Some & CPU>",
    ):  # fmt: skip
        assert text in shown.text
    assert "<b>" not in source and "<room>" not in source
    assert [each["class"] for each in shown.all("td") if "class" in each] == ["failed"] * 2


def test_sections_stand_in_order(tmp_path, page_parts):
    shown = page_parts(written(tmp_path, full_page()))
    headings = ("The room", "The way", "The figures", "What the agents saw", "Learning", "How this was made")
    places = [shown.texts.index(heading) for heading in headings]
    assert places == sorted(places) and len(shown.all("section")) == len(headings)


def test_pictures_are_relative_and_nothing_comes_from_elsewhere(tmp_path, page_parts):
    source = written(tmp_path, full_page())
    shown = page_parts(source)
    pictures = {each["src"]: each["alt"] for each in shown.all("img")}
    assert list(pictures) == [f"pictures/{name}.png" for name in ("a", "b", "map%201", "sheet", "curves")]
    assert list(pictures.values()) == ["State 1", "State 2", 'a "map"', "Views", "Curves"]
    assert [each["href"] for each in shown.all("a")] == list(pictures)
    assert not {"script", "link", "iframe"} & {tag for tag, _ in shown.seen}
    assert "http:" not in source and "https:" not in source and "url(" not in source
    assert "prefers-color-scheme: dark" in source


def test_a_page_without_pictures_has_no_empty_sections(tmp_path, page_parts):
    shown = page_parts(written(tmp_path, Page(title="t", sentence="s", table=TABLE)))
    assert len(shown.all("section")) == 1 and not shown.all("dl") and not shown.all("pre")
