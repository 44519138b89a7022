"""README and results tell the figures of the evidence, which other tests compute anew from records."""

import re

import pytest

from helpers.published import DOCS, EVIDENCE, RESULTS, assert_written, numbers, rows_of, section_of

README = (DOCS.parent / "README.md").read_text(encoding="utf-8")
SEEING = (DOCS / "seeing.md").read_text(encoding="utf-8")
FRESH = rows_of(section_of(EVIDENCE, "The paper's claims of fresh seeds"))
ROOMS = rows_of(section_of(EVIDENCE, "Across rooms"))


def row(rows: list[list[str]], *begin: str) -> list[str]:
    """The rest of the one row that begins so."""
    (found,) = [own for own in rows if own[: len(begin)] == list(begin)]
    return found[len(begin) :]


def assert_same(shown: str, *cells: str, scale: float = 1) -> None:
    """All numbers of a text are those of the evidence's cells, rounded."""
    exact = [float(number) * scale for cell in cells for number in numbers(cell.replace(",", ""))]
    written = numbers(shown.replace(",", ""))
    assert len(written) == len(exact), (shown, cells)
    for number, value in zip(written, exact, strict=True):
        assert_written(number, value, shown)


def sentence(pattern: str, page: str) -> tuple[str, ...]:
    """What a page says at the groups of a pattern; lines may break anywhere."""
    found = re.search(pattern.replace(" ", r"\s+"), page)
    assert found is not None, pattern
    return found.groups()


CLAIMS = {
    "fewer collisions": "fewer collisions than with the shortest-path reward",
    "less than a tenth of them": "less than a tenth of the collisions with the shortest-path reward",
    "fewer at the worst target": "fewer collisions in the worst case (the target with the most, in each run)",
    "no more steps": "no more steps than with the shortest-path reward",
    "settles sooner": "learns faster (fewer frames until training has settled)",
    "fewer steps halfway": "learns faster (fewer steps halfway)",
    "fewer collisions halfway": "learns faster (fewer collisions halfway)",
    "halfway close to the end: steps": "halfway is close to the end (no more steps)",
    "generalises better: success": "generalises better (higher sc on unseen targets)",
    "generalises better: SPL": "generalises better (higher SPL on unseen targets)",
    "success falls with distance, both rewards together": "success falls with distance (higher sc 1 step away than 8)",
}
"""Of the results' table in the bathroom, as the evidence has them."""
PAPER = RESULTS.partition("## The paper's experiments")[2].partition("\n### ")[0]


def test_results_have_the_bathrooms_claims() -> None:
    shown = [cells for cells in rows_of(PAPER) if len(cells) == 3][1:]
    assert [cells[0] for cells in shown] == list(CLAIMS)
    for claim, verdict, figures in shown:
        judged, own, other, *_ = row(FRESH, CLAIMS[claim])
        assert verdict == judged, claim
        figures = re.sub(r"; random walk.*", "", figures)
        scale = 100 if "%" in figures else 1
        if claim in ("less than a tenth of them", "success falls with distance, both rewards together"):
            own, other = own.split(" (")[0], other.split(" (")[0]  # means alone
        assert_same(figures, own, other, scale=scale)


def test_results_have_the_rooms_claims() -> None:
    own, other, settles = sentence(
        r"`collision-aware` has ([\d.]+ \([\d.-]+\)) collisions, `shortest` ([\d.]+ \([\d.-]+\)): "
        r"fewer in every room, in no more steps. "
        r"Whether it settles sooner \(in (\w+) it does\) is undecided",
        RESULTS,
    )
    fewer, sooner, steps = (
        row(ROOMS, f"{claim} than shortest") for claim in ("fewer collisions", "settles sooner", "no more steps")
    )
    assert_same(f"{own} {other}", *fewer[1:3])
    assert [cells[0] for cells in (fewer, sooner, steps)] == ["holds", "undecided", "holds"]
    assert (fewer[5], sooner[5], settles) == ("12 of 12", "10 of 12", "ten")
    poses = [int(cells[1]) for cells in ROOMS if len(cells) == 9 and cells[1].isdigit()]
    assert f"({min(poses)} to {max(poses)} poses" in RESULTS and f"the twelve: {min(poses)} to {max(poses)})" in README


def test_results_have_what_clipping_does() -> None:
    agents = {name: row(FRESH, name) for name in ("shortest, unclipped", "collision-aware, unclipped", "bump")}
    aware, shortest, bump = sentence(
        r"is undecided\*\*: `collision-aware` (\S+ \([^)]*\)), `shortest` (\S+ \([^)]*\)); they .* "
        r"Clipped, `bump` has (\S+ \([^)]*\))",
        RESULTS,
    )
    for told, name in ((aware, "collision-aware, unclipped"), (shortest, "shortest, unclipped"), (bump, "bump")):
        assert_same(told, agents[name][1])
    steps = sentence(r"have not converged \(([\d.]+) and ([\d.]+) steps, not ([\d.]+)\)", RESULTS)
    assert_same(" ".join(steps[:2]), *(agents[f"{name}, unclipped"][0].split(" (")[0] for name in REWARDS))
    assert f"without clipping at {steps[2]} steps" in EVIDENCE


REWARDS = ("collision-aware", "shortest")


def test_results_show_earlier_figures_where_later_ones_lie_outside_their_intervals() -> None:
    earlier = sentence(
        r"\(evidence.md#the-papers-claims-of-fresh-seeds\) had ([\d.]+) against ([\d.]+) collisions", RESULTS
    )
    assert earlier[::-1] == sentence(r"earlier seeds: ([\d.]+) \(once 0.184\), ([\d.]+) \(no record\)", README)
    assert "An older set without a record had 0.184 collisions under `shortest`" in EVIDENCE
    hard = rows_of(section_of(EVIDENCE, "Hard targets"))
    steps, collisions = sentence(r"Seeds 0-4 \(`collision-aware`, 1 M\): steps (\S+), collisions (\S+)\.", RESULTS)
    for told, begin in ((steps, "steps of `collision-aware` after 1 M"), (collisions, "its collisions then")):
        assert told.replace("-", " to ") == row(hard, begin)[1]
    (found,) = sentence(r"not 10.6 % \(7.2-15.3\) \(seeds 0-4: (\S+ %)\);", RESULTS)
    assert f"where it was {found.replace('-', ' to ')}" in EVIDENCE
    shortest, aware, bump = sentence(r"\[earlier seeds\]\(evidence.md#four-rooms\): (\S+), (\S+), ([\d.]+)\.", RESULTS)
    told = rf"collisions {shortest} \(\S+\), {bump} \(\S+\) and {aware} \(\S+\) under `shortest`, `bump` and"
    assert re.search(told.replace(".", r"\."), EVIDENCE)
    (perturbed,) = sentence(r"five earlier: ([\d.]+)\)", RESULTS)
    earlier_rows = EVIDENCE.partition("| seen on the way | agent | trained on | seeds |")[2]
    of_all = ("everything perturbed", "collision-aware", "perturbed pictures too", "0 to 4")
    *_, collisions = row(rows_of(earlier_rows), *of_all)
    assert collisions.startswith(f"{perturbed} (")


def test_results_have_the_shares_of_time_in_the_zone_after_2_m_frames() -> None:
    told = sentence(r"After 2 M: ([\d.]+), ([\d.]+), ([\d.]+) \(unasked\)", RESULTS)
    part = section_of(EVIDENCE, "Time in the zones").partition("After 2 M frames")[2]
    for share, agent in zip(told, ("collision-aware", "shortest", "bump"), strict=True):
        assert row(rows_of(part), agent)[0].startswith(f"{share} % (")


def test_results_have_the_bedrooms_collisions() -> None:
    own, other = sentence(r"among them collisions: (\S+ \([^)]*\)) against (\S+ \([^)]*\))\.", RESULTS)
    found = row(
        rows_of(section_of(EVIDENCE, "The bedroom, of fresh seeds")),
        "fewer collisions than with the shortest-path reward",
    )
    assert found[0] == "undecided"
    assert_same(f"{own} {other}", *found[1:3])


def test_results_have_the_figures_off_the_grid() -> None:
    found = EVIDENCE.partition("\n### Fifteen seeds, after 1.5 M frames")[2].partition("\n### ")[0]
    exact = {cells[0]: [*cells[1:3], cells[4]] for cells in rows_of(found)[1:7]}
    shown = {name: own for name, *own in rows_of(RESULTS.partition("## Off the")[2])[1:6]}
    assert set(exact) - {"clearance"} == set(shown)
    for name, own in shown.items():
        assert_same(" ".join(own), *exact[name])
    verdicts = [cells[-1] for cells in rows_of(found) if len(cells) == 5]
    assert [verdicts.count(verdict) for verdict in ("holds", "does not hold")] == [5, 0] and len(verdicts) == 1 + 15
    assert "five of twelve claims hold" in RESULTS
    limit = [cells for cells in rows_of(found) if len(cells) == 5 and cells[3] == "0.05"]
    assert len(limit) == 3 and all(cells[-1] == "holds" for cells in limit)
    assert sum(cells[0].startswith("clearance,") for cells in limit) == 2
    assert "hold, three barely (two of reward `clearance`)" in RESULTS


def test_the_first_page_has_the_bathrooms_figures() -> None:
    table = rows_of(README.partition("## Why")[2].partition("\n## ")[0])
    for begin, claim in (
        ("collisions an episode", "fewer collisions"),
        ("steps (undecided; shortest path: 8.79)", "no more steps"),
        ("frames until learnt", "settles sooner"),
    ):
        ((_, shortest, aware),) = [cells for cells in table if cells[0].startswith(begin)]
        verdict, own, other, *_ = row(FRESH, CLAIMS[claim])
        assert_same(f"{shortest} {aware}", other, own)
        assert aware.startswith("**") is (verdict == "holds")
    (bumps,) = sentence(r"Penalising \[bumps alone\]\([^)]*\) leaves fewer, ([\d.]+)\.", README)
    assert_same(bumps, row(FRESH, "bump")[1].split(" (")[0])
    own, other, walk = sentence(
        r"success is lower \(([\d.]+), not ([\d.]+) %; random walk: (\d+) %\); SPL: und", README
    )
    verdict, exact, others, *_ = row(FRESH, CLAIMS["generalises better: success"])
    assert_same(f"{own} {other}", exact.split(" (")[0], others.split(" (")[0], scale=100)
    assert verdict == "does not hold" and row(FRESH, CLAIMS["generalises better: SPL"])[0] == "undecided"
    assert_written(walk, 47.5, "random walk")
    assert "a random walk comes to 47.5 % of these targets" in EVIDENCE


def test_the_first_page_has_the_rooms_and_the_bedrooms_verdicts() -> None:
    fewer, sooner = (row(ROOMS, f"{claim} than shortest") for claim in ("fewer collisions", "settles sooner"))
    assert "collide a fifth as often as with the shortest-path reward, in no more" in README
    assert 0.175 < float(fewer[3].split(" (")[0]) < 0.225 and sooner[0] == "undecided"
    (told,) = re.findall(
        r"of ([a-z]+) claims holds \(([a-z]+) undecided; three not run\); the shortest-path reward learns sooner",
        README,
    )
    assert f"{told[1]} of {told[0]} do not hold, {told[1]} are undecided" in EVIDENCE
    assert (
        row(
            rows_of(section_of(EVIDENCE, "The bedroom, of fresh seeds")),
            "`shortest` settles sooner than `collision-aware`",
        )[-1]
        == "holds"
    )


@pytest.mark.parametrize(
    ("pattern", "named"),
    [
        (r"by path length\) (\d+) %", ("No tour", "rooms")),
        (r"after a 500-step tour ([\d.]+) %", ("After a tour", "rooms, after a tour")),
        (r"\(perturbed: ([\d.]+)\)", ("Under perturbed pictures", "toured, perturbed")),
        (r"in flats (\d+) \(registered: 35\) and", ("No tour", "flats")),
        (r"in flats \d+ \(registered: 35\) and (\d+) %", ("After a tour", "flats, after a tour")),
    ],
)
def test_the_first_page_has_the_generalists_figures(pattern: str, named: tuple[str, str]) -> None:
    (told,) = sentence(pattern, README)
    title, begin = named
    spl = row(rows_of(section_of(SEEING, title)), begin)[2]
    assert_same(told, spl.split(" (")[0])


def test_the_first_page_has_what_was_registered_of_flats() -> None:
    (told,) = sentence(r"in flats \d+ \(registered: (\d+)\)", README)
    assert row(rows_of(SEEING), "flats, no tour: success, SPL")[0].endswith(f", {told} %")


def test_off_the_grid_the_first_page_says_what_is_decided() -> None:
    (told,) = sentence(r"\[Off the grid\]\([^)]*\) (collision-aware agents .*? \(published settings\))\.", README)
    assert " ".join(told.split()) == (
        "collision-aware agents stay less near obstacles than shortest-path ones; beside bumps alone, and contacts: "
        "undecided (published settings)"
    )
    verdicts = {
        claim: verdict
        for claim, *_, verdict in rows_of(section_of(EVIDENCE, "Fifteen seeds, after 1.5 M frames"))
        if claim.startswith("collision-aware, ")
    }
    near = [f"collision-aware, less time within {far} cm than" for far in (10, 30)]
    assert {verdicts[f"{claim} shortest"] for claim in near} == {"holds"}
    beside = {verdict for claim, verdict in verdicts.items() if claim.endswith(" bump") or "contacts" in claim}
    assert beside == {"undecided"} and len(verdicts) == 10
