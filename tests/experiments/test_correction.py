"""Verdicts corrected for the number of claims."""

import numpy as np
import pytest

from clearway.evaluation.across_seeds import permutation_p
from clearway.experiments.correction import corrected, holm
from clearway.experiments.section import Claim, Section

ONE = np.zeros(1, np.int64)


def column(*values: float) -> np.ndarray:
    return np.array(values)[:, None]


def test_p_of_runs_that_are_wholly_apart_is_the_least_there_is() -> None:
    low, high = column(1, 2, 3, 4, 5), column(11, 12, 13, 14, 16)
    assert permutation_p(low, high, ONE) == pytest.approx(2 / 252)
    assert permutation_p(high, low, ONE) == pytest.approx(2 / 252)
    assert permutation_p(low, low + 0.1, ONE) > 0.5
    assert permutation_p(low + 10.2, high, ONE, allowed=10.2) == pytest.approx(2 / 252)


def test_p_is_uniform_where_there_is_no_difference() -> None:
    rng = np.random.default_rng(0)
    found = [permutation_p(rng.normal(size=(5, 2)), rng.normal(size=(5, 2)), np.array([0, 1])) for _ in range(400)]
    assert 0.02 < np.mean(np.array(found) <= 0.05) < 0.085
    assert 0.4 < np.mean(found) < 0.6


def test_p_of_ten_and_ten_runs_is_exact() -> None:
    ten = column(*range(10))
    assert permutation_p(ten, ten + 20, ONE) == 2 / 184_756


def test_p_of_one_run_beside_two_hundred_is_exact() -> None:
    assert permutation_p(column(-1), column(*range(200)), ONE) == pytest.approx(1 / 201, rel=1.1)


def test_p_of_many_runs_is_drawn() -> None:
    rng = np.random.default_rng(1)
    many = rng.normal(size=(12, 1))
    assert permutation_p(many, many + 5, ONE) < 1e-3


def test_holm_s_own_example_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]) == [1.0, 1.0]


def section_of(*p: float | None, names: str = "a") -> Section:
    texts = [f"{name}: {number}" for number, name in enumerate(names * len(p) if len(names) == 1 else names)]
    return Section("s", "", "", claims=tuple(Claim(t, "holds", "E.", p=own) for t, own in zip(texts, p, strict=True)))


def test_a_claim_that_holds_by_itself_may_not_hold_among_many() -> None:
    verdicts = [claim.verdict for claim in corrected(section_of(0.001, 0.02, 0.03)).claims]
    assert verdicts == ["holds", "holds", "holds"]
    first, second, third = corrected(section_of(0.001, 0.03, 0.04)).claims
    assert (first.verdict, second.verdict, third.verdict) == ("holds", "undecided", "undecided")
    assert "p = 0.03, for 3 claims 0.06 (Holm). By itself: holds." in second.evidence
    assert corrected(section_of(0.04)).claims[0].verdict == "holds"


def test_learners_are_families_of_their_own_and_what_was_not_tested_stays() -> None:
    assert [claim.verdict for claim in corrected(section_of(0.03, 0.03, names="ab")).claims] == ["holds", "holds"]
    first, *_ = corrected(section_of(0.032, None, None)).claims
    assert (first.verdict, "for 3 claims 0.096 (Holm)" in first.evidence) == ("undecided", True)  # as it will be
    (claim,) = corrected(section_of(None)).claims
    assert claim.evidence == "E."


def test_claims_that_name_no_learner_are_judged_together() -> None:
    section = Section("s", "", "", claims=tuple(Claim(f"Claim {n}.", "holds", "E.", p=0.03) for n in range(3)))
    assert {claim.verdict for claim in corrected(section).claims} == {"undecided"}
    (alone,) = corrected(Section("s", "", "", claims=section.claims[:1])).claims
    assert alone.verdict == "holds"
