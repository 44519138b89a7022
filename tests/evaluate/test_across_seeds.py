import numpy as np
import pytest

from clearway.evaluate.across_seeds import difference, mean_estimate, probability_of_less

SCENE = np.array([0, 0, 0, 1])  # three targets in one scene, one in another


def test_scenes_count_alike_however_many_targets_they_have() -> None:
    scores = np.array([[1.0, 2.0, 3.0, 10.0], [3.0, 4.0, 5.0, 20.0]])
    assert mean_estimate(scores, SCENE).value == pytest.approx((3 + 15) / 2)


def test_seeds_that_agree_leave_an_interval_without_width() -> None:
    assert mean_estimate(np.ones((4, 4)), SCENE).interval == (1.0, 1.0)


def test_the_interval_holds_the_mean_and_narrows_with_seeds() -> None:
    rng = np.random.default_rng(0)
    widths = []
    for seeds in (5, 80):
        found = mean_estimate(rng.normal(size=(seeds, 4)), SCENE)
        low, high = found.interval
        assert low < found.value < high
        widths.append(high - low)
    assert widths[1] < widths[0] / 2


def test_one_seed_has_no_interval() -> None:
    assert mean_estimate(np.ones((1, 4)), SCENE).interval is None
    assert difference(np.ones((1, 4)), np.ones((3, 4)), SCENE).interval is None


def test_the_difference_is_signed() -> None:
    first, second = np.zeros((3, 4)), np.ones((2, 4))
    found = difference(first, second, SCENE)
    assert found.value == -1
    assert found.interval == (-1, -1)


def test_probability_of_less_by_hand() -> None:
    """Scene 0: pairs (1,2) less, (1,1) tie, (3,2) more, (3,1) more: 1.5 of 4 for every target; scene 1: all less."""
    first = np.array([[1.0, 1, 1, 0], [3.0, 3, 3, 0]])
    second = np.array([[2.0, 2, 2, 5], [1.0, 1, 1, 5]])
    assert probability_of_less(first, second, SCENE).value == pytest.approx((1.5 / 4 + 1) / 2)


def test_probability_of_less_is_a_half_among_equals() -> None:
    scores = np.random.default_rng(1).normal(size=(6, 4))
    assert probability_of_less(scores, scores, SCENE).value == pytest.approx(0.5)
