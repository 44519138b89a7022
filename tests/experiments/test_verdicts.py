import numpy as np
import pytest

from clearway.experiments.verdicts import judged_less, judged_more, judged_no_more

SCENE = np.array([0, 0])


def scores(*means: float) -> np.ndarray:
    """(R, 2), a seed a mean."""
    return np.repeat(np.array(means)[:, None], 2, axis=1)


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        (scores(1, 1.1, 0.9), scores(2, 2.1, 1.9), "holds"),
        (scores(2, 2.1, 1.9), scores(1, 1.1, 0.9), "does not hold"),
        (scores(1, 3, 2), scores(2, 1, 3), "undecided"),
        (scores(1), scores(2), "undecided"),  # one seed says nothing
        (scores(1, 1), scores(), "undecided"),
    ],
)
def test_fewer(first: np.ndarray, second: np.ndarray, verdict: str) -> None:
    assert judged_less("fewer", "collisions", first.reshape(-1, 2), second.reshape(-1, 2), SCENE).verdict == verdict


@pytest.mark.parametrize(
    ("first", "verdict"),
    [
        (scores(10.1, 10.1, 10.1), "holds"),  # 1 % more is no more
        (scores(10.5, 10.5, 10.5), "does not hold"),
        (scores(9, 11, 10), "undecided"),
        (scores(5, 5, 5), "holds"),
    ],
)
def test_no_more(first: np.ndarray, verdict: str) -> None:
    claim = judged_no_more("no more", "steps", first, scores(10, 10, 10), SCENE)
    assert claim.verdict == verdict
    assert "3 and 3 seeds" in claim.evidence


def test_more_is_fewer_the_other_way_round() -> None:
    low, high = scores(1, 1.1, 0.9), scores(2, 2.1, 1.9)
    claim = judged_more("more", "sc", high, low, SCENE)
    assert claim.verdict == "holds"
    assert "probability that a run has more: 1 [1, 1]" in claim.evidence
    assert "difference 1 [" in claim.evidence
    assert judged_more("more", "sc", low, high, SCENE).verdict == "does not hold"
    assert judged_more("more", "sc", scores(1, 3, 2), scores(2, 1, 3), SCENE).verdict == "undecided"
    assert judged_more("more", "sc", scores(1), scores(2), SCENE).verdict == "undecided"
