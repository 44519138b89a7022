"""The report's page, from sections written by hand."""

import json
from base64 import b64decode
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.experiments.section import Claim, ReportFigure, ReportTable, Section, Series
from clearway.viz.report import SHOWN_ROWS, write_report

LONG = "a sentence that is broken into lines because it has so many words"
TABLE = ReportTable(
    "kept", "Kept & shown", ("agent", "steps", "note"), (("<i>ours</i>", 1234.5, LONG), ("x", None, "")), ("A note.",)
)
MANY = ReportTable("many", "Many", ("n",), tuple((n,) for n in range(SHOWN_ROWS + 7)), folded=True)
FIGURE = ReportFigure("line", 'A "line"', "x", "y", (Series("a", [0, 1], [1, 2]),))
CLAIM = Claim("paper: it <works>", "holds", "9 < 10", p=0.01)
SECTION = Section(
    "first", "First <section>", "What was done.", (TABLE, MANY), (FIGURE,), claims=(CLAIM,), missing=("run",)
)


@pytest.fixture
def written(tmp_path: Path) -> str:
    facts = {"command": "clearway reproduce --out '<here>'"}
    return write_report(tmp_path, "A & B", [SECTION], facts, "Only <smoke>.", []).read_text(encoding="utf-8")


def test_everything_is_shown_and_nothing_is_taken_for_markup(written, page_parts):
    shown = page_parts(written)
    for text in (
        "A & B", "Only <smoke>.", "First <section>", "What was done.", "Kept & shown", "<i>ours</i>", "1,234", LONG,
        "A note.", "paper: it <works>", "holds", "9 < 10", 'A "line"', "clearway reproduce --out '<here>'",
        "1 run is not complete yet; the tables hold what is.",
    ):  # fmt: skip
        assert text in shown.texts
    assert not {"i", "here", "works", "smoke"} & {tag for tag, _ in shown.seen}
    assert shown.texts.count("paper: it <works>") == 2  # among all verdicts and in its section
    assert "paper, the paper's claims. Holds (1): it <works>." in shown.texts
    assert [each.get("id") for each in shown.all("section")] == [None, None, "first", None]


def test_where_nothing_is_judged_no_verdict_is_listed(tmp_path, page_parts):
    undecided = replace(SECTION, claims=(replace(CLAIM, verdict="undecided", p=None),))
    page = write_report(tmp_path, "T", [undecided], {}, "", []).read_text(encoding="utf-8")
    assert CLAIM.text not in page_parts(page).texts and "No claim is judged (1 asked)" in page
    assert CLAIM.text not in (tmp_path / "report.md").read_text(encoding="utf-8")


def test_columns_of_words_stand_on_the_left(written, page_parts):
    kept = page_parts(written[written.index("<h3>Kept") : written.index("<details>")])
    looks = ["words", None, "words long"]
    assert [each.get("class") for each in kept.all("th")] == looks
    assert [each.get("class") for each in kept.all("td")] == looks * 2


def test_a_long_table_is_folded_and_says_where_the_rest_is(written, page_parts):
    folded = page_parts(written[written.index("<details>") : written.index("</details>")] + "</details>")
    assert folded.texts == ["Many", "n", *map(str, range(SHOWN_ROWS)), "7 more rows in tables/many.csv"]


def test_pictures_are_inside(written, page_parts, tmp_path):
    (picture,) = page_parts(written).all("img")
    kind, content = picture["src"].split(",")
    assert kind == "data:image/png;base64" and picture["alt"] == 'A "line"'
    assert b64decode(content) == (tmp_path / "figures/line.png").read_bytes()


def test_no_warning_is_no_paragraph(tmp_path, page_parts):
    page = write_report(tmp_path, "T", [], {}, "", []).read_text(encoding="utf-8")
    assert not page_parts(page).all("p")[1:]  # the mark alone


def test_numbers_of_numpy_stand_as_python_s(tmp_path):
    values = (np.int64(1234), np.float32(0.5), np.bool_(True), None)
    table = ReportTable("numpy", "N", ("a", "b", "c", "d"), (values,))
    figure = ReportFigure(
        "line",
        "L",
        "x",
        "y",
        (Series("a", np.arange(2), np.float32([1, 2]), low=np.zeros(2), high=np.float32([3, 4])),),
    )
    write_report(tmp_path, "T", [Section("s", "S", "Text.", (table,), (figure,))], {}, "", [])
    (section,) = json.loads((tmp_path / "report.json").read_text())["sections"]
    assert section["tables"][0]["rows"] == [[1234, 0.5, True, None]]
    (line,) = section["figures"][0]["series"]
    assert (line["x"], line["y"], line["low"], line["high"]) == ([0, 1], [1.0, 2.0], [0.0, 0.0], [3.0, 4.0])
    assert (tmp_path / "tables" / "numpy.csv").read_text().splitlines() == ["a,b,c,d", "1234,0.5,True,"]
    assert "| 1,234 | 0.5 | yes |" in (tmp_path / "report.md").read_text()
