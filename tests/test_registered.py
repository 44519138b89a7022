"""Every question was written before it was answered, as its page says, and stands there as it was written."""

import json
import re
import shutil
import subprocess
import tarfile
from datetime import datetime
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "registered.md"
COMMIT = r"[0-9a-f]{7}"
ROW = re.compile(
    rf"^\| (?P<questions>[^|]+) \| (?P<written>{COMMIT}(, (changed: )?{COMMIT})*)"
    rf" \| (?P<answered>{COMMIT}|not yet|never: [^|]+) \|$",
    re.M,
)
ROWS = [
    (row["questions"], re.findall(COMMIT, row["written"]), row["answered"]) for row in ROW.finditer(PAGE.read_text())
]
NAMES = [questions for questions, *_ in ROWS]
QUESTION = re.compile(r"^(\d+)\. (.*?)(?=^\d+\. |^\s*$|^#)", re.M | re.S)


def split(page: str) -> list[str]:
    """Its sections, each from its heading on."""
    return re.split(r"^(?=##+ )", page, flags=re.M)


SECTIONS = {part.partition("\n")[0].strip("# "): part for part in split(PAGE.read_text())}
RECORDS = ROOT / "docs" / "records"
ASKED_FIRST = {
    ("a3c-longer", ""): {63},
    ("a3c-targets", "a2c-"): {70},
    ("a3c-targets", "a3c-"): {71, 72},
    ("across-rooms", ""): {68},
    ("bedroom-fresh", "a2c-collision-aware-"): {38},
    ("bedroom-fresh", "a2c-shortest-"): {38},
    ("bedroom-fresh", "a2c-bump-"): {59, 62},
    ("bedroom-fresh", "bc-"): {59},
    ("bedroom-fresh", "q-learning-"): {59},
    ("clipping-bathroom", ""): {78},
    ("constant-rate", ""): {80},
    ("fewer-environments", ""): {79},
    ("fig6-bathroom", ""): {67},
    ("four-rooms-default", ""): {64, 65},
    ("four-rooms-longer", ""): {37},
    ("four-rooms-seeds", ""): {73},
    ("four-rooms-zones", ""): {66},
    ("further-room", ""): {69},
    ("hard-bathroom", ""): {58},
    ("off-grid-settled", ""): {75},
    ("perturbed-bathroom", ""): {74},
    ("shuffles-bathroom", ""): {61, 62},
    ("step-size-bathroom", ""): {60},
    ("without-hindsight", ""): {76},
    ("without-lookahead", ""): {76},
    ("without-whitening", ""): {76},
}
"""Records of which runs tell when they were begun, how names of such runs begin, and the questions written before."""
REWORDED = {"6e991c2", "825fb65"}
"""Commits that put a question into clearer words while its runs were made; the page says so on top."""
ADDED_LATER = "paper-bathroom.tar.xz"
"""Of its runs only those tell it that were added after the answer (Q-learning, cloning): nothing of 51 and 52."""


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
        end = answered if re.fullmatch(COMMIT, answered) else "HEAD"
        assert git("merge-base", "--is-ancestor", commit, end).returncode == 0, questions


def asked(text: str) -> set[tuple[int, str]]:
    """The numbered questions of a page, with their numbers; however their lines are broken."""
    return {(int(number), " ".join(words.split())) for number, words in QUESTION.findall(text)}


def numbers_of(questions: str) -> set[int]:
    """Those that a row names."""
    told = re.sub(r"(?:figures?|tables?) \d+(?: and \d+)*|\d+ M frames", "", questions.partition(" of ")[0])
    ranges = re.findall(r"(\d+)(?: to (\d+))?", told)
    return {number for first, last in ranges for number in range(int(first), int(last or first) + 1)}


@cache
def pages_at(commit: str) -> tuple[str, ...]:
    """All pages at a commit."""
    names = git("ls-tree", "-r", "--name-only", commit, "docs").stdout.split()
    return tuple(git("show", f"{commit}:{name}").stdout for name in names if name.endswith(".md"))


@with_history
@pytest.mark.parametrize(("questions", "written", "answered"), ROWS, ids=NAMES)
def test_a_question_stands_as_it_was_written(questions: str, written: list[str], answered: str) -> None:
    del answered
    here = asked(PAGE.read_text(encoding="utf-8"))
    then = {one for commit in written for page in pages_at(commit) for one in asked(page)}
    assert {number for number, _ in here & then} >= numbers_of(questions)


def commands(text: str) -> list[str]:
    """What of a page is to be run, however its lines are broken."""
    return [" ".join(words.split()) for words in re.findall(r"`((?:clearway |python |--)[^`]+)`", text)]


@with_history
@pytest.mark.parametrize("title", SECTIONS)
def test_commands_stand_as_they_were_written_with_their_questions(title: str) -> None:
    numbers = {number for number, _ in asked(SECTIONS[title])}
    written = {commit for questions, commits, _ in ROWS if numbers_of(questions) & numbers for commit in commits}
    pages = [page for commit in written for page in pages_at(commit)]
    parts = [part for page in pages for part in split(page) if asked(part) & asked(SECTIONS[title])]
    then = {command for part in parts for command in commands(part)}
    assert not written or set(commands(SECTIONS[title])) <= then


def begun(record: Path, runs: str = "") -> list[datetime]:
    """When the runs of a record whose names begin so were begun, of those that tell it."""
    with tarfile.open(record) as members:
        wanted = [one for one in members if re.fullmatch(rf"runs/{re.escape(runs)}[^/]*/run\.json", one.name)]
        times = [json.load(file).get("begun") for one in wanted if (file := members.extractfile(one))]
    return [datetime.fromisoformat(time) for time in times if time]


@pytest.mark.parametrize("record", sorted({path.name for path in RECORDS.glob("*.tar.xz")} - {ADDED_LATER}))
def test_it_is_known_what_runs_that_tell_their_date_were_made_for(record: str) -> None:
    known = [runs for name, runs in ASKED_FIRST if name == record.partition(".")[0]]
    of_known = [len(begun(RECORDS / record, runs)) for runs in known]
    assert sum(of_known) == len(begun(RECORDS / record)), "name the questions in ASKED_FIRST"


@with_history
@pytest.mark.parametrize(("record", "runs"), sorted(ASKED_FIRST))
def test_runs_were_begun_after_their_question_was_written(record: str, runs: str) -> None:
    times, asked_by_it = begun(RECORDS / f"{record}.tar.xz", runs), ASKED_FIRST[record, runs]
    commits = {
        commit for questions, written, _ in ROWS if asked_by_it & numbers_of(questions) for commit in written
    } - REWORDED
    assert times and commits
    for commit in commits:
        assert datetime.fromisoformat(git("log", "-1", "--format=%cI", commit).stdout.strip()) < min(times)


NAMED = re.compile(r"\[([Qq]uestions? \d[^]()]*) \(([^)]*)\)\]\(")
VERDICTS = {
    (path.name, questions, commits)
    for path in sorted((ROOT / "docs").glob("*.md"))
    for questions, commits in NAMED.findall(path.read_text(encoding="utf-8"))
}


@pytest.mark.parametrize(("page", "questions", "commits"), sorted(VERDICTS))
def test_a_verdict_names_the_commit_that_wrote_its_question(page: str, questions: str, commits: str) -> None:
    last = {written[-1] for rows, written, _ in ROWS if numbers_of(rows) & numbers_of(questions) and " of " not in rows}
    assert set(commits.split(", ")) == (last or {"not shown"})


LATE = {13}  # registered late
PLAIN = re.compile(r"(?<!\[)\b[Qq]uestions? (\d+(?:(?:, | and | to )\d+)*)")


@pytest.mark.parametrize(
    "page", ["docs/results.md", "docs/evidence.md", "docs/seeing.md", "docs/learning.md", "docs/zones.md", "README.md"]
)
def test_no_verdict_names_a_question_without_its_commit(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert not re.findall(r"\[[Qq]uestions? \d[^]()]*\]\(", text)
    named = {number for questions, _ in NAMED.findall(text) for number in numbers_of(questions)}
    plain = {number for questions in PLAIN.findall(text) for number in numbers_of(questions)}
    assert plain <= named | LATE


def test_a_changed_question_is_another() -> None:
    page = "1. Is it so?\n2. Is it\n   so, too?\n\nNot 3.\n"
    assert asked(page) == {(1, "Is it so?"), (2, "Is it so, too?")}
    assert not asked(page.replace("?", ", for two claims?")) & asked(page)


def test_results_name_the_exceptions_among_their_questions() -> None:
    def numbers(text: str) -> set[int]:
        ranges = re.findall(r"(\d+)(?: to (\d+)|-(\d+))?", text)
        return {number for low, *high in ranges for number in range(int(low), int("".join(high) or low) + 1)}

    bullets = PAGE.read_text().partition("\n- ")[2].partition("\n\n")[0]
    begins = re.findall(
        r"(?:^|\n- |\. )(?:For )?(\d+(?: to \d+)?(?:, \d+)*)(?=:| was| it cannot| in the bedroom)", bullets
    )
    exceptions = set[int]().union(*map(numbers, begins))
    assert {13, 25, 36, 17, 24, 50, 45, 47, 66, 69, 77, 78, 59, 62} <= exceptions and 51 not in exceptions
    page = (ROOT / "docs/results.md").read_text()
    (told,) = re.findall(r"\[exceptions\]\([^)]*\): (.*?); of ", page)
    named = set[int]().union(*(numbers_of(questions) for questions, _ in NAMED.findall(page)))
    assert named & exceptions <= numbers(told) <= exceptions
