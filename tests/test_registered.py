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


def test_rows_are_found() -> None:
    assert len(ANSWERED) >= 8


@pytest.mark.skipif(
    shutil.which("git") is None or git("rev-parse", "--verify", "aff96b9^{commit}").returncode != 0,
    reason="the history is not here",
)
@pytest.mark.parametrize(("questions", "written", "answered"), ANSWERED, ids=[row[0] for row in ANSWERED])
def test_a_question_was_written_before_it_was_answered(questions: str, written: list[str], answered: str) -> None:
    for commit in written:
        assert commit != answered
        assert git("merge-base", "--is-ancestor", commit, answered).returncode == 0, questions
