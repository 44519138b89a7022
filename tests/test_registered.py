"""Every question was written before it was answered, as its page says, and stands there as it was written."""

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "registered.md"
COMMIT = r"[0-9a-f]{7}"
ROW = re.compile(
    rf"^\| (?P<questions>[^|]+) \| (?P<written>{COMMIT}(, (changed: )?{COMMIT})*)"
    rf" \| (?P<answered>{COMMIT}|not yet) \|$",
    re.M,
)
ROWS = [
    (row["questions"], re.findall(COMMIT, row["written"]), row["answered"]) for row in ROW.finditer(PAGE.read_text())
]
NAMES = [questions for questions, *_ in ROWS]
QUESTION = re.compile(r"^(\d+)\. (.*?)(?=^\d+\. |^\s*$|^#)", re.M | re.S)


def git(*words: str) -> subprocess.CompletedProcess[str]:
    """What git says here."""
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)


with_history = pytest.mark.skipif(
    shutil.which("git") is None or git("rev-parse", "--verify", "aff96b9^{commit}").returncode != 0,
    reason="the history is not here",
)


def test_every_row_names_commits_or_says_why_not() -> None:
    table = PAGE.read_text().partition("|---|---|---|\n")[2].partition("\n\n")[0].splitlines()
    others = [row for row in table if not ROW.match(row)]
    assert len(ROWS) + len(others) == len(table)
    for row in others:
        *_, written, answered = (cell.strip() for cell in row.strip("|").split("|"))
        assert written.startswith("not ") or answered.startswith("never"), row


@with_history
@pytest.mark.parametrize(("questions", "written", "answered"), ROWS, ids=NAMES)
def test_a_question_was_written_before_it_was_answered(questions: str, written: list[str], answered: str) -> None:
    for commit in written:
        assert commit != answered
        end = "HEAD" if answered == "not yet" else answered
        assert git("merge-base", "--is-ancestor", commit, end).returncode == 0, questions


def asked(text: str) -> set[tuple[int, str]]:
    """The numbered questions of a page, with their numbers; however their lines are broken."""
    return {(int(number), " ".join(words.split())) for number, words in QUESTION.findall(text)}


@cache
def asked_at(commit: str) -> set[tuple[int, str]]:
    """Those of all pages at a commit."""
    pages = [
        page for page in git("ls-tree", "-r", "--name-only", commit, "docs").stdout.split() if page.endswith(".md")
    ]
    return {one for page in pages for one in asked(git("show", f"{commit}:{page}").stdout)}


@with_history
@pytest.mark.parametrize(("questions", "written", "answered"), ROWS, ids=NAMES)
def test_a_question_stands_as_it_was_written(questions: str, written: list[str], answered: str) -> None:
    del answered
    ranges = re.findall(r"(\d+)(?: to (\d+))?", questions.partition(" of ")[0])
    numbers = {number for first, last in ranges for number in range(int(first), int(last or first) + 1)}
    here = asked(PAGE.read_text(encoding="utf-8"))
    then = {one for commit in written for one in asked_at(commit)}
    assert {number for number, _ in here & then} >= numbers


def test_a_changed_question_is_another() -> None:
    page = "1. Is it so?\n2. Is it\n   so, too?\n\nNot 3.\n"
    assert asked(page) == {(1, "Is it so?"), (2, "Is it so, too?")}
    assert not asked(page.replace("?", ", for two claims?")) & asked(page)
