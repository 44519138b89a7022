"""The demo's page fits a screen of 1,280 pixels and a phone, without scrolling sideways."""

from dataclasses import replace

import pytest

from clearway.evaluation.tables import COLUMNS, Cell, TableText
from clearway.viz.page import KeyFigure, Opening, Page, write_page
from helpers.browser import opened_browser

NAMES = (("collision-aware", "sampled"), ("shortest, alpha -0.02", "argmax untried"), ("optimum", "collision-aware"))


def widest() -> Page:
    """As many columns and as long figures as the demo's tables can have."""
    figure = Cell("1,044.00", "1022.00–1066.00")
    headings = ("scene", "agent", "solved", *(column.heading for column in COLUMNS))
    rows = tuple(
        (Cell("living_room", "target 1234"), Cell(*name), Cell("✗ 66.6 %", failed=True), *[figure] * len(COLUMNS))
        for name in NAMES
    )
    table = TableText(headings, rows, ("Encoder: clearway.",))
    page = Page("Two agents in one room", "They walk.", table, more_tables={"Every target": table})
    return replace(
        page,
        opening=Opening([KeyFigure(f"figure {number}", "100 %", "99.9–100") for number in range(4)]),
        commands=["clearway demo " + "--out a/very/long/folder " * 8],
        facts={"Hardware": "x" * 200},
    )


@pytest.fixture(scope="module")
def browser():
    with opened_browser() as browser:
        yield browser


@pytest.mark.parametrize(("width", "is_card"), [(1280, False), (390, True), (360, True), (900, True)])
def test_nothing_is_cut_or_scrolled_sideways(browser, tmp_path, width, is_card):
    path = write_page(tmp_path, widest())
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.goto(path.as_uri())
    page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    wider = "[...document.querySelectorAll('.scroll, pre')].filter(one => one.scrollWidth > one.clientWidth).length"
    assert page.evaluate(wider) == 0
    assert page.locator("thead").first.is_visible() != is_card
    page.close()
