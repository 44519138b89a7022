"""What pages say, held against what records hold."""

import json
import re
import runpy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from clearway.experiments.groups import EXACT, WALKED
from clearway.experiments.section import Claim, ReportTable, Section
from helpers.report_tables import by_heading

DOCS = Path(__file__).parents[2] / "docs"
RESULTS, EVIDENCE = ((DOCS / name).read_text(encoding="utf-8") for name in ("results.md", "evidence.md"))


def benchmark(name: str) -> dict[str, Any]:
    """What a benchmark defines."""
    return runpy.run_path(str(DOCS.parent / "benchmarks" / f"{name}.py"))


def unpack(record: str, folder: Path, *further: str) -> None:
    """Write what a record holds, and further ones, to a new folder."""
    records = [DOCS / "records" / f"{name}.tar.xz" for name in (record, *further)]
    benchmark("records")["unpack"](records, folder)


def section_of(page: str, title: str) -> str:
    """What stands under the page's first heading that begins so, down to the next of that level."""
    return page.partition(f"### {title}")[2].partition("\n### ")[0]


def rows_of(text: str) -> list[list[str]]:
    """Cells of all rows of its tables, headings too."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines]


def seconds_of_runs(folder: Path, runs: str = "*") -> list[float]:
    """How long each training of a folder of an experiment took."""
    ends = [path.read_text(encoding="utf-8").splitlines()[-1] for path in folder.glob(f"runs/{runs}/metrics.jsonl")]
    return [json.loads(end)["seconds"] for end in ends]


def numbers(cell: str) -> list[str]:
    """Those of "93.3 % (92.1-94.4)", as they are written."""
    return re.findall(r"\d+(?:\.\d+)?", cell)


def words_of(pattern: str, page: str, flags: int = 0) -> re.Match[str]:
    """Where a page says something, which it has to."""
    found = re.search(pattern, page, flags)
    assert found is not None, f"no page says {pattern}"
    return found


def assert_written(written: str, value: float, what: str) -> None:
    """A figure is written to its last digit."""
    digits = len(written.partition(".")[2])
    assert abs(float(written) - value) <= 0.5001 * 10**-digits, f"{what}: written {written}, recorded {value}"


def assert_shown(cell: str, value: float, interval: str, scale: float = 1) -> None:
    """A cell shows a mean and its interval."""
    mean, *ends = numbers(cell.replace(",", ""))
    assert_written(mean, scale * value, cell)
    for written, end in zip(ends, numbers(interval.replace(",", "")), strict=True):
        assert_written(written, scale * float(end), cell)


def ends_of(interval: str) -> list[float]:
    """Those of an interval in a report."""
    return [float(end) for end in numbers(interval.replace(",", ""))]


def check_ends(section: Section, page: str) -> None:
    """Figure 3's table of collisions: every kind of agent that it has, as recorded."""
    recorded = {
        row["agent"] if row["learner"] in ("paper", "default", WALKED, EXACT) else row["learner"]: row
        for row in by_heading(section.tables[0])
        if row["figure"] == "collisions"
    }
    told: set[str] = set()
    table = page.partition("**Figure 3 in numbers**")[2].split("\n\n")[1]
    for agents, best, worst, target, of_any in rows_of(table)[1:]:
        names, _, frames = agents.partition(", ")
        for name in names.split("; "):
            row = recorded[name]
            assert_written(best, row["best seed"], name)
            assert_written(worst or best, row["worst seed"], name)
            assert_shown(target, row["worst target"], row["95 %"] or "")
            assert_written(of_any, row["worst target of any seed"], name)
            assert frames == (row["agent"] if row["agent"].endswith(" frames") else "")
            told.add(name)
    assert told == set(recorded)


def held_out_rows(section: Section, shown: Sequence[Sequence[str]]) -> dict[str, dict[str, Any]]:
    """Figure 6's rows by what trained, or stands beside; those of a page's table, and no others, are as recorded."""
    found = {}
    for row in by_heading(section.tables[0]):
        beside = row["agent"] if row["learner"] == WALKED else f"{row['learner']}, {row['agent']}"
        found[str(row["targets a scene"] or beside)] = row
    assert [row[0] for row in shown] == list(found)
    for name, learnt, *cells in shown:
        row = found[name]
        if learnt:
            assert_written(learnt.rstrip(" %"), 100 * row["sc on trained targets"], name)
        estimates = ("sc", "95 % of sc"), ("sc within 4 x shortest", "95 % of that"), ("SPL", "95 % of SPL")
        for cell, (figure, interval) in zip(cells, estimates, strict=True):
            assert_shown(cell, row[figure], row[interval] or "", scale=100)
    return found


UNTRAINED = {"q-learning": "Q-learning", "bc": "behaviour cloning"}
LEARNERS = set(UNTRAINED.values())
BESIDE = {"planner on a learnt map", "nearest picture", "shortest path", "random walk"}
"""Who stands beside the agents in a table; some have `LEARNERS` too."""


def check_beside(rows: list[list[str]], recorded: Sequence[Sequence[Any]], steps: int, collisions: int) -> set[str]:
    """What stands beside the agents in a page's table: its steps and collisions, in these columns, are recorded.

    Args:
        rows: of the page's table; a row may name several, with one figure each or one of all.
        recorded: rows of a report's table of steps and collisions.
        steps, collisions: where they stand in a row.

    Returns:
        Whom the page names.
    """
    known: dict[str, dict[str, float]] = {}
    agents: dict[str, str] = {}
    for figure, learner, agent, *_, average, _, _ in recorded:
        own = learner in (EXACT, WALKED, "paper")
        name = agent if own else UNTRAINED.get(learner, learner)
        known.setdefault(name, {})[figure] = average
        agents[name] = agent
    told: set[str] = set()
    for row in rows:
        fixed = row[0].removeprefix("soft fixed points: ")
        names = [part.partition(",")[0] for part in row[0].split("; ")]
        if fixed != row[0]:
            names = [f"soft fixed point ({name})" for name in fixed.split(", ")]
        if set(names) & {"shortest", "bump", "collision-aware", "own shuffle"} or not set(names) <= set(known):
            continue
        for figure, column in (("steps", steps), ("collisions", collisions)):
            written = row[column].split(", " if fixed != row[0] else "; ")
            for name, one in zip(names, written * (len(names) // len(written)), strict=True):
                assert_written(one.replace(",", ""), known[name][figure], f"{figure} of {name}")
        told |= set(names)
        assert_frames(row[0], agents)
    return told


def check_arms(lines: list[list[str]], table: ReportTable, late: ReportTable, called: Mapping[str, str]) -> None:
    """Rows of a page: what was changed, reward, settled after, steps, collisions, failed targets; all as recorded.

    Args:
        lines: of the page's table.
        table: steps and collisions.
        late: frames until training had settled, a row an arm.
        called: what the page calls each learner.
    """
    own = {(row["figure"], row["learner"], row["agent"]): row for row in by_heading(table)}
    for row in by_heading(late):
        learner, agent = row["learner"], row["agent"]
        ((frames, steps, bumps, lost),) = [line[2:6] for line in lines if line[:2] == [called[learner], agent]]
        until, ran = frames.rsplit(", ", 1)
        assert_shown(until, row["frames"], row["95 %"])
        assert ran == f"{row['settled']} of {row['seeds']}"
        for figure, cell in (("steps", steps), ("collisions", bumps)):
            recorded = own[figure, learner, agent]
            assert_shown(cell, recorded["average"], recorded["95 %"])
            assert lost == recorded["failed targets"]


def assert_frames(cell: str, agents: dict[str, str]) -> None:
    """The frames that a cell tells of those it names before them are recorded: "Q-learning; map, 11,600 frames"."""
    names: list[str] = []
    for part in cell.split("; "):
        name, _, frames = part.partition(", ")
        names.append(name)
        if frames.endswith(" frames"):
            exact = frames.replace(" M frames", ",000,000 frames")
            assert {agents[one] for one in names} == {exact}, cell
            names = []


def assert_judged(
    claim: Claim, verdict: str, p: str, corrected: str, own: str = "", other: str = "", difference: str = ""
) -> None:
    """A claim's row shows its verdict, its p and what figures the row has, as the claim's evidence writes them."""
    assert own or difference, "a row shows figures"
    own, other, difference = (cell.replace("(", "[").replace(")", "]") for cell in (own, other, difference))
    assert verdict == claim.verdict, claim.text
    assert f": {own}" in claim.evidence and f" against {other}" in claim.evidence, claim.text
    assert f", difference {difference}" in claim.evidence, claim.text
    assert f"p = {p}, for " in claim.evidence and f" claims {corrected} (Holm)" in claim.evidence, claim.text
