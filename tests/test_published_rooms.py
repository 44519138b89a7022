"""What the evidence says of rooms that were generated for it is what their records come to."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from clearway.experiments.reproduce import gather
from clearway.experiments.section import Claim
from helpers.published import (
    EVIDENCE,
    assert_written,
    rows_of,
    seconds_of_runs,
    section_of,
    unpack,
)
from helpers.report_tables import by_heading


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
