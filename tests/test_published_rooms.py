"""What the evidence says of rooms that were generated for it is what their records come to."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pytest

from clearway.experiments.correction import LEVEL, holm
from clearway.experiments.groups import WALKED
from clearway.experiments.reproduce import gather
from clearway.experiments.section import Claim, Section
from helpers.published import (
    BESIDE,
    EVIDENCE,
    LEARNERS,
    RESULTS,
    UNTRAINED,
    assert_judged,
    assert_shown,
    assert_written,
    check_beside,
    check_ends,
    held_out_rows,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading

FIXED = {f"soft fixed point ({name})" for name in ("shortest", "bump", "collision-aware")}
VERDICTS = ("holds", "does not hold", "undecided")


@pytest.mark.slow
def test_twelve_rooms_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("across-rooms", tmp_path / "across")
    (section,) = gather(tmp_path / "across").sections
    assert section.name == "across-rooms" and not section.missing
    page = section_of(EVIDENCE, "Across rooms")
    rooms, judged = (rows_of(part)[1:] for part in page.split("\n\n") if part.startswith("| "))
    rows = by_heading(section.tables[0])
    assert len(rows) == 24 and len(rooms) == 12
    both = list(zip(rows[::2], rows[1::2], strict=True))
    for line, pair in zip(rooms, both, strict=True):
        check_room(line, pair)
    assert len(judged) == 3
    for claim, line in zip(section.claims, judged, strict=True):
        check_over_rooms(claim, line)
    seconds = seconds_of_runs(tmp_path / "across")
    assert len(seconds) == 24 and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in page
    assert all(row["settled"] and row["failed targets"] == "0 of 5" for row in rows)
    assert all(second[name] < first[name] for first, second in both for name in ("collisions", "steps"))
    ratios = sorted(second["frames until settled"] / first["frames until settled"] for first, second in both)
    assert f"({ratios[0]:.2f} to {ratios[9]:.2f} times `shortest`'s frames)" in page and ratios[9] < ratios[10] == 1
    assert f"in one (kitchen 4) after {ratios[11]:.1f} times as many" in page
    beside = by_heading(section.tables[1])
    assert {(row["agent"], row["seeds"], row["failed targets"]) for row in beside} == {
        (agent, 1, "0 of 5") for agent in ("planner on a learnt map", "nearest picture")
    }
    maps = [int(str(row["map of"]).removesuffix(" frames").replace(",", "")) for row in beside]
    assert f"on a map of each ({min(maps):,} to {max(maps):,} frames of random walkers, one seed a room)" in page
    assert len(beside) == 24 and all(row["steps"] == row["shortest path"] and row["collisions"] == 0 for row in beside)


def check_room(line: list[str], pair: Sequence[dict]) -> None:
    """A row of the table of rooms, of both rewards."""
    name, poses, walk, shortest, *settled, collisions, steps, lost = line
    kind, number = name.rsplit(" ", 1)
    assert [row["agent"] for row in pair] == ["shortest", "collision-aware"]
    for place, row in enumerate(pair):
        assert row["room"] == f"room-validation-{int(number):06d}-{kind.replace(' ', '_')}-68"
        assert int(poses) == row["poses"]
        assert_written(walk.replace(",", ""), row["random walk's steps"], name)
        assert_written(shortest, row["shortest path"], name)
        has = "" if row["settled"] else ", not settled"
        assert settled[place] == f"{row['frames until settled']:,.0f}{has}"
        for cell, figure in ((collisions, "collisions"), (steps, "steps")):
            assert_written(cell.split(", ")[place], row[figure], f"{figure} in {name}")
        assert lost.split(", ")[place] == row["failed targets"].removesuffix(" of 5")


def check_over_rooms(claim: Claim, line: list[str]) -> None:
    """A verdict over rooms, as its evidence writes it."""
    text, verdict, own, other, ratio, median, rooms, p, corrected = line
    own, other, ratio = (cell.replace("(", "[").replace(")", "]") for cell in (own, other, ratio))
    assert claim.text == f"paper: over rooms, collision-aware, {text}" and verdict == claim.verdict
    allowed = "1.02" if text.startswith("no more steps") else "1"
    assert (
        f": {own} against {other}, ratio {ratio}, geometric mean over rooms (median {median}); "
        f"it lies below {allowed} in {rooms} rooms." in claim.evidence
    )
    assert f"p = {p}, for 3 claims {corrected} (Holm)" in claim.evidence


@pytest.mark.slow
def test_all_tables_in_a_further_room_are_what_their_record_comes_to(tmp_path: Path) -> None:
    unpack("further-room", tmp_path / "room")
    sections = {section.name: section for section in gather(tmp_path / "room").sections}
    assert list(sections) == ["table1", "fig3", "fig4", "table2", "table3", "fig5", "fig6", "zone-time"]
    assert not any(section.missing for section in sections.values())
    page = section_of(EVIDENCE, "All tables in a further room")
    tables = [rows_of(part)[1:] for part in page.split("\n\n") if part.startswith("| ")]
    agents, judged, _, unseen, held_out, in_zones = tables
    check_agents(sections, agents)
    claims = [claim for section in sections.values() for claim in section.claims]
    assert [line[0] for line in judged] == [shortened(claim) for claim in claims]
    for claim, (_, verdict, own, other, apart, p, corrected) in zip(claims, judged, strict=True):
        assert_judged(claim, verdict, p, corrected, own, other, apart)
    check_ends(sections["fig3"], page)
    check_unseen(sections["fig5"], unseen)
    held_out_rows(sections["fig6"], held_out)
    check_in_zones(sections["zone-time"], in_zones)
    not_asked = ("paper, unclipped", "paper: no more steps than with a penalty for bumping on hard targets")
    check_counts([claim for claim in claims if not claim.text.startswith(not_asked)], page)
    seconds = seconds_of_runs(tmp_path / "room", "a2c-*")
    assert f"{len(seconds)} runs" in page and f"{min(seconds):.0f} to {max(seconds):.0f} s a run" in page


def shortened(claim: Claim) -> str:
    """How a claim stands in a table of one learner's."""
    return claim.text.removeprefix("paper: ").removeprefix("paper, ").removeprefix("collision-aware, ")


OF_THE_SAME_RUNS = re.compile(
    r"(shortest-path reward|in each run\)|halfway\)|training has settled\)|collision zone than shortest)$"
)
"""Ends of claims that compare the two rewards' runs on usual targets."""


def check_counts(asked: Sequence[Claim], page: str) -> None:
    """How many of the claims that were asked hold, do not, or are undecided; and what of it would stay together."""
    assert all(claim.p is not None for claim in asked)
    count = Counter(claim.verdict for claim in asked)
    ps = holm([claim.p for claim in asked if claim.p is not None])
    kept = [shortened(claim) for claim, p in zip(asked, ps, strict=True) if p <= LEVEL and claim.verdict == "holds"]
    assert kept == [
        "hard targets are harder (larger detours)",
        "2 times the frames repair hard targets (no larger detours)",
        "success falls with distance (higher sc 1 step away than 8)",
    ]
    words = ("hold", "do not", "are undecided")
    told = ", ".join(f"{count[verdict]} {word}" for verdict, word in zip(VERDICTS, words, strict=True))
    assert f"Of {len(asked)} claims {told}" in page
    assert f"corrected all together {len(kept)} would hold" in page
    of_the_same_runs = [claim for claim in asked if claim.verdict == "holds" and OF_THE_SAME_RUNS.search(claim.text)]
    assert len(of_the_same_runs) == 7 and "seven of the 20 compare the same five runs" in page
    assert (count["holds"], len(asked), count["does not hold"], count["undecided"]) == (20, 29, 3, 6)
    assert "20 of 29 claims hold, three do not, six are undecided** (corrected by table; overall, three that" in RESULTS
    assert "collisions (0.065 against 0.179) and frames until settled (395,000 against 462,000) are fewer" in RESULTS
    shown = {claim.text: f"{claim.evidence} " for claim in asked}
    fewer = shown["paper: fewer collisions than with the shortest-path reward"]
    settled = shown["paper: learns faster (fewer frames until training has settled)"]
    assert re.search(r": 0\.0652 \[.* against 0\.179 ", fewer) and re.search(r": 395,200 .* against 461,600 ", settled)


def check_agents(sections: dict[str, Section], lines: list[list[str]]) -> None:
    """The table of agents: halfway and in the end, on usual and on hard targets, and who stands beside."""
    told = set()
    for row in by_heading(sections["fig4"].tables[0]):
        if row["learner"] == "paper" and row["frames"] == 400_000:
            (line,) = [line for line in lines if line[:3] == [row["agent"], "usual", "0.4 M"]]
            assert_shown(line[4], row["steps"], row["95 %"])
            assert_shown(line[5], row["collisions"], row["95 % of collisions"])
            assert line[3] == "" and line[6] == row["failed targets"]
            told.add(tuple(line[:3]))
    for name, kind, frames in (("table1", "usual", "0.8 M"), ("table2", "hard", "0.8 M"), ("table3", "hard", "1.6 M")):
        rows = by_heading(sections[name].tables[0])
        late = {row["agent"]: row for row in by_heading(sections["fig4" if name == "table1" else name].tables[-1])}
        for line in (line for line in lines if line[1:3] == [kind, frames]):
            agent, learner = line[0].removesuffix(", unclipped"), "paper"
            if agent != line[0]:
                learner += ", unclipped"
            for figure, cell in (("steps", line[4]), ("collisions", line[5])):
                ((value, interval, lost),) = [
                    (row["average"], row["95 %"], row["failed targets"])
                    for row in rows
                    if (row["figure"], row["learner"], row["agent"]) == (figure, learner, agent)
                ]
                assert_shown(cell, value, interval)
                assert line[6] == lost
            if line[3]:
                after, ran = line[3].split("), ")
                assert_shown(after, late[agent]["frames"], late[agent]["95 %"])
                assert ran == f"{late[agent]['settled']} of 5" and learner == "paper"
            told.add(tuple(line[:3]))
        beside = [line for line in lines if line[1] == kind and not line[2]]
        assert check_beside(beside, sections[name].tables[0].rows, 4, 5) == BESIDE | LEARNERS | FIXED
    assert len(told) == 2 + 5 + 3 + 3


def check_unseen(section: Section, lines: list[list[str]]) -> None:
    """Figure 5's table: every agent at each distance."""
    rows = by_heading(section.tables[0])
    known = {(str(row["steps away"]), name_of(row)): row for row in rows}
    told = set()
    for steps, names, targets, *cells in lines:
        for name in names.split("; "):
            row = known[steps, name.partition(", ")[0]]
            assert targets == str(row["targets"])
            estimates = ("sc", "95 % of sc"), ("sc within 4 x shortest", "95 % of that"), ("SPL", "95 % of SPL")
            for cell, (figure, interval) in zip(cells, estimates, strict=True):
                assert_shown(cell, row[figure], (row[interval] or "") if "(" in cell else "", scale=100)
            told.add((steps, name.partition(", ")[0]))
    assert told == set(known)


def check_in_zones(section: Section, lines: list[list[str]]) -> None:
    """The table of time in the zones."""
    known = {name_of(row): row for row in by_heading(section.tables[0])}
    told = set()
    for names, *cells in lines:
        for name in (each.partition(", ")[0] for each in names.split("; ")):
            figures = [heading for heading in section.tables[0].headings[3:] if not heading.startswith("95 %")]
            for cell, figure in zip(cells, figures, strict=True):
                interval = known[name][f"95 % of {figure}"] if "(" in cell else ""
                assert_shown(cell, known[name][figure], interval, scale=100 if figure.startswith("share") else 1)
            told.add(name)
    assert told == set(known)


def name_of(row: dict) -> str:
    """Who a row is of, without frames."""
    own = row["learner"] in ("paper", WALKED)
    return str(row["agent"] if own else UNTRAINED.get(row["learner"], row["learner"]))
