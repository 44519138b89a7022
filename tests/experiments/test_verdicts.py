import numpy as np
import pytest

from clearway.experiments.verdicts import judged_less, judged_more, judged_no_more, with_failures

SCENE = np.array([0, 0])


def scores(*means: float) -> np.ndarray:
    """(R, 2), a seed a mean."""
    return np.repeat(np.array(means)[:, None], 2, axis=1)


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        (scores(1, 1.1, 0.9, 1), scores(2, 2.1, 1.9, 2), "holds"),
        (scores(2, 2.1, 1.9, 2), scores(1, 1.1, 0.9, 1), "does not hold"),
        (scores(1, 3, 2, 2), scores(2, 1, 3, 2), "undecided"),
        (scores(1, 1.1, 0.9), scores(2, 2.1, 1.9, 2), "undecided"),  # three seeds say too little
        (scores(1), scores(2), "undecided"),  # one seed says nothing
        (scores(1, 1), scores(), "undecided"),
    ],
)
def test_fewer(first: np.ndarray, second: np.ndarray, verdict: str) -> None:
    assert judged_less("fewer", "collisions", first.reshape(-1, 2), second.reshape(-1, 2), SCENE).verdict == verdict


@pytest.mark.parametrize(
    ("first", "verdict"),
    [
        (scores(10.1, 10.1, 10.1, 10.1), "holds"),  # 1 % more is no more
        (scores(10.5, 10.5, 10.5, 10.5), "does not hold"),
        (scores(9, 11, 10, 10), "undecided"),
        (scores(5, 5, 5, 5), "holds"),
    ],
)
def test_no_more(first: np.ndarray, verdict: str) -> None:
    claim = judged_no_more("no more", "steps", first, scores(10, 10, 10, 10), SCENE)
    assert claim.verdict == verdict
    assert "4 and 4 seeds" in claim.evidence


def test_more_is_fewer_the_other_way_round() -> None:
    low, high = scores(1, 1.1, 0.9, 1), scores(2, 2.1, 1.9, 2)
    claim = judged_more("more", "sc", high, low, SCENE)
    assert claim.verdict == "holds"
    assert "probability of improvement, mean over targets: 1 [1 to 1]" in claim.evidence
    assert "difference 1 [" in claim.evidence
    assert claim.numbers["difference"].value == pytest.approx(1)
    assert judged_more("more", "sc", low, high, SCENE).verdict == "does not hold"
    assert judged_more("more", "sc", scores(1, 3, 2, 2), scores(2, 1, 3, 2), SCENE).verdict == "undecided"
    assert judged_more("more", "sc", scores(1), scores(2), SCENE).verdict == "undecided"


def test_runs_of_two_rewards_are_not_seeds_twice() -> None:
    low, high = scores(1, 1.1, 0.9, 1.2, 1, 0.9), scores(2, 2.1, 1.9, 2.2, 2, 1.9)
    assert judged_more("more", "sc", high, low, SCENE).verdict == "holds"
    claim = judged_more("more", "sc", high, low, SCENE, rewards=2)
    assert (claim.verdict, claim.p) == ("undecided", None)
    assert "; 3 and 3 seeds of 2 rewards each. Fewer than 4 seeds decide nothing." in claim.evidence
    low, high = (np.concatenate([each, each[:2]]) for each in (low, high))
    assert judged_no_more("no more", "steps", low, high, SCENE, rewards=2).verdict == "holds"


def test_failed_targets_are_told_beside_the_means() -> None:
    claim = judged_less("fewer", "steps", scores(1, 1, 1, 1), scores(2, 2, 2, 2), SCENE)
    success = np.ones((4, 2))
    success[2, 1] = 0.99
    told = with_failures(claim, np.ones((4, 2)), success, SCENE)
    assert told.evidence.endswith(
        "Failed targets, over all seeds: 0 of 8, 1 of 8; episodes that arrived: 100.00%, 99.88%."
    )
    assert told.verdict == "holds"
    same = with_failures(claim, np.ones((4, 2)), np.ones((4, 2)), SCENE)
    assert same.evidence.endswith("Failed targets, over all seeds: 0 of 8, 0 of 8.")
    assert with_failures(claim, np.empty((0, 2)), success, SCENE) == claim


def test_who_arrives_less_often_is_not_told_better() -> None:
    """An agent that spins on the spot has no collisions."""
    spinning, walking = np.zeros((4, 2)), np.ones((4, 2))
    fewer = judged_less("fewer", "collisions", scores(0, 0, 0, 0), scores(1, 2, 1, 2), SCENE)
    assert fewer.verdict == "holds"
    assert with_failures(fewer, spinning, walking, SCENE).verdict == "undecided"
    assert with_failures(fewer, walking, spinning, SCENE).verdict == "holds"
    assert with_failures(fewer, walking - 0.009, walking, SCENE).verdict == "holds"
    assert with_failures(fewer, walking - 0.011, walking, SCENE).verdict == "undecided"
    other = judged_less("fewer", "collisions", scores(1, 2, 1, 2), scores(0, 0, 0, 0), SCENE)
    assert other.verdict == "does not hold"
    assert with_failures(other, walking, spinning, SCENE).verdict == "undecided"
    assert with_failures(other, spinning, walking, SCENE).verdict == "does not hold"


def test_arrivals_weigh_scenes_alike_as_the_figures_do() -> None:
    """One target in a scene where a twentieth gets lost, nine in another: half of a twentieth, not a tenth of it."""
    scenes = np.array([0, *[1] * 9])
    fewer, more = np.full((4, 10), 1.0) + np.arange(4)[:, None] / 10, np.full((4, 10), 2.0)
    claim = judged_less("fewer", "collisions", fewer, more, scenes)
    lost = np.ones((4, 10))
    lost[:, 0] = 0.95
    assert claim.verdict == "holds" and lost.mean() > 0.99
    told = with_failures(claim, lost, np.ones((4, 10)), scenes)
    assert told.verdict == "undecided" and "episodes that arrived: 97.50%, 100.00%" in told.evidence


@pytest.mark.parametrize(("more", "verdict"), [(1.015, "holds"), (1.025, "does not hold")])
def test_two_per_cent_more_are_no_more(more: float, verdict: str) -> None:
    claim = judged_no_more("no more", "steps", scores(*[10 * more] * 4), scores(10, 10, 10, 10), SCENE)
    assert claim.verdict == verdict


def test_thousands_are_written_out() -> None:
    claim = judged_less("fewer", "frames", scores(1e6, 2e6, 1.5e6, 1.2e6), scores(4e6, 5e6, 4e6, 4e6), SCENE)
    assert "1,425,000" in claim.evidence and "e+" not in claim.evidence
