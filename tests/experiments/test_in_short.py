"""What a report answers first."""

from clearway.experiments.in_short import MOST_LINES, in_short, is_judged
from clearway.experiments.section import Claim, Section, Verdict


def section(*claims: Claim) -> list[Section]:
    return [Section("s", "", "", claims=claims)]


def claim(text: str, verdict: Verdict, further: bool = False, p: float | None = 0.01) -> Claim:
    return Claim(text, verdict, "", further=further, p=p)


def test_a_line_for_each_learner_says_what_holds_and_what_does_not() -> None:
    found = in_short(
        section(
            claim("paper: fewer collisions", "holds"),
            claim("paper: no more steps", "undecided"),
            claim("default: fewer collisions", "does not hold"),
            claim("paper: fewer than with bump", "does not hold", further=True),
        )
    )
    assert found == (
        "paper, the paper's claims. Holds (1): fewer collisions. Undecided (1): no more steps.",
        "default, the paper's claims. Does not hold (1): fewer collisions.",
        "paper, further claims. Does not hold (1): fewer than with bump.",
    )


def test_where_runs_are_too_few_one_line_says_so() -> None:
    few = section(*(claim(f"paper: {number}", "undecided", p=None) for number in range(30)))
    (line,) = in_short(few)
    assert line.startswith("No claim is judged (30 asked): fewer than 4 complete runs")
    assert not is_judged(few) and in_short(section()) == ()
    counted = section(Claim("paper: all are good", "undecided", "4 of 4. Still to come: 1.", counted=True))  # without p
    assert is_judged(counted) and in_short(counted)[0].endswith("Undecided (1): all are good.")


def test_a_section_with_a_rule_of_its_own_says_why_nothing_is_judged() -> None:
    asked = (claim("paper: all rooms", "undecided", p=None),)
    own = Section("s", "", "", claims=asked, unjudged="six rooms are needed")
    alone, both = in_short([own]), in_short([own, own, *section(*asked), Section("t", "", "", unjudged="no claims")])
    assert alone == ("No claim is judged (1 asked): six rooms are needed. The tables hold what was measured.",)
    (line,) = both
    assert "(3 asked): six rooms are needed; fewer than 4 complete runs of a kind decide nothing. The" in line


def test_it_is_never_longer_than_ten_lines() -> None:
    found = in_short(section(*(claim(f"learner {number}: better", "holds") for number in range(30))))
    assert len(found) == MOST_LINES and found[-1] == "And 21 more lines, below."


def test_many_claims_of_a_kind_are_counted() -> None:
    (line,) = in_short(section(*(claim(f"paper: {name}", "holds") for name in "abcde")))
    assert line == "paper, the paper's claims. Holds (5): a; b; c; and 2 more."


def test_claims_of_no_learner_are_told_whole() -> None:
    claims = [claim("Clearance collides less.", "holds"), claim("It is slower.", "undecided", further=True)]
    assert in_short(section(*claims)) == (
        "The paper's claims. Holds (1): Clearance collides less.",
        "Further claims. Undecided (1): It is slower.",
    )
