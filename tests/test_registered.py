"""Every question was written before it was answered, as its page says."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "registered.md"
ROW = re.compile(
    r"^\| (?P<questions>[^|]+) \| (?P<written>[0-9a-f]{7}[0-9a-f, ]*) \| (?P<answered>[0-9a-f]{7}) \|$", re.M
)
ANSWERED = [(row["questions"], row["written"].split(", "), row["answered"]) for row in ROW.finditer(PAGE.read_text())]


def git(*words: str) -> subprocess.CompletedProcess[str]:
    """What git says here."""
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)


def test_every_row_names_commits_or_says_why_not() -> None:
    table = PAGE.read_text().partition("|---|---|---|\n")[2].partition("\n\n")[0].splitlines()
    others = [row for row in table if not ROW.match(row)]
    assert len(ANSWERED) + len(others) == len(table)
    for row in others:
        *_, written, answered = (cell.strip() for cell in row.strip("|").split("|"))
        assert written.startswith("not ") or answered.startswith(("not yet", "never")), row


@pytest.mark.skipif(
    shutil.which("git") is None or git("rev-parse", "--verify", "aff96b9^{commit}").returncode != 0,
    reason="the history is not here",
)
@pytest.mark.parametrize(("questions", "written", "answered"), ANSWERED, ids=[row[0] for row in ANSWERED])
def test_a_question_was_written_before_it_was_answered(questions: str, written: list[str], answered: str) -> None:
    for commit in written:
        assert commit != answered
        assert git("merge-base", "--is-ancestor", commit, answered).returncode == 0, questions
