import numpy as np
import pytest

from clearway.evaluation.across_seeds import (
    Estimate,
    _interval,
    difference,
    mean_estimate,
    permutation_p,
    probability_of_less,
)

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


def test_targets_that_one_run_learns_together_are_no_independent_evidence() -> None:
    runs = np.array([[0.1], [0.2], [0.4], [0.5], [0.8]])
    alike = np.repeat(runs, 100, axis=1)  # whichever target one looks at, a good run is good
    one, many = (mean_estimate(scores, np.zeros(scores.shape[1], int)) for scores in (runs, alike))
    assert many.interval == pytest.approx(one.interval)


@pytest.mark.slow
def test_intervals_of_five_runs_hold_the_truth_nearly_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    trials = 600
    means = [mean_estimate(rng.normal(size=(5, 1)), SCENE[:1], resamples=3000).interval for _ in range(trials)]
    pairs = [difference(*rng.normal(size=(2, 5, 1)), SCENE[:1], resamples=3000).interval for _ in range(trials)]
    for intervals, least in ((means, 0.90), (pairs, 0.94)):  # plain percentiles: 0.83 and 0.87
        assert least < sum(low <= 0 <= high for low, high in intervals) / trials < 0.985


def test_one_seed_has_no_interval() -> None:
    assert mean_estimate(np.ones((1, 4)), SCENE).interval is None
    assert difference(np.ones((1, 4)), np.ones((3, 4)), SCENE).interval is None


def test_the_difference_is_signed() -> None:
    first, second = np.zeros((3, 4)), np.ones((2, 4))
    found = difference(first, second, SCENE)
    assert found.value == -1
    assert found.interval == (-1, -1)


def unequal(place: int) -> np.ndarray:
    """Five runs of five targets, of which one is not always arrived at."""
    return np.where(np.arange(5) == place, 0.93, 1.0) * np.ones((5, 1))


@pytest.mark.parametrize(
    ("first", "second", "allowed"),
    [
        (unequal(4), unequal(0), 0.0),
        (np.full((5, 25), 0.99), np.full((6, 25), 0.99), 0.0),
        (np.full((6, 25), 0.99), np.full((8, 25), 0.99), 0.0),
        (np.full((5, 4), 0.3), np.full((5, 4), 0.2), 0.1),
        (np.zeros((5, 4)), np.zeros((5, 4)), 0.0),
    ],
)
def test_what_rounding_leaves_is_no_difference(first: np.ndarray, second: np.ndarray, allowed: float) -> None:
    scene = np.zeros(first.shape[1], int)
    assert permutation_p(first, second, scene, allowed) == permutation_p(second + allowed, first, scene) == 1
    found = difference(first, second, scene)
    assert (found.value, *found.interval) == pytest.approx((allowed,) * 3, abs=1e-12)
    assert allowed or (found.value, *found.interval) == (0, 0, 0)


def test_small_differences_stay() -> None:
    first, second = np.full((5, 4), 1e-9), np.full((5, 4), 2e-9)
    assert permutation_p(first, second, SCENE) == pytest.approx(2 / 252)
    assert difference(first, second, SCENE).interval == pytest.approx((-1e-9, -1e-9))


def test_probability_of_less_by_hand() -> None:
    """Scene 0: pairs (1,2) less, (1,1) tie, (3,2) more, (3,1) more: 1.5 of 4 for every target; scene 1: all less."""
    first = np.array([[1.0, 1, 1, 0], [3.0, 3, 3, 0]])
    second = np.array([[2.0, 2, 2, 5], [1.0, 1, 1, 5]])
    assert probability_of_less(first, second, SCENE).value == pytest.approx((1.5 / 4 + 1) / 2)


def test_probability_of_less_is_a_half_among_equals() -> None:
    scores = np.random.default_rng(1).normal(size=(6, 4))
    assert probability_of_less(scores, scores, SCENE).value == pytest.approx(0.5)


def test_an_interval_of_five_runs_is_expanded_as_student_s_t_asks() -> None:
    """t of 4 degrees of freedom is 2.776; times sqrt(5 / 4) it is 3.104, where the normal leaves 0.00095."""
    low, high = _interval(np.linspace(0, 1, 1_000_001), 5) or (0, 0)
    assert (low, 1 - high) == (pytest.approx(0.000954, rel=0.01), pytest.approx(0.000954, rel=0.01))


@pytest.mark.parametrize(("value", "text"), [(999.4, "999"), (999.7, "1,000"), (-999.7, "-1,000"), (0.01234, "0.0123")])
def test_numbers_are_never_written_with_an_exponent(value: float, text: str) -> None:
    assert str(Estimate(value, None)).startswith(text)


def test_the_probability_of_improvement_has_an_interval_where_runs_differ() -> None:
    first, second = np.array([[1.0], [3.0], [5.0]]), np.array([[2.0], [4.0], [6.0]])
    found = probability_of_less(first, second, np.array([0]))
    assert found.value == pytest.approx(6 / 9)  # 1 below all three, 3 below two, 5 below one
    low, high = found.interval
    assert low < 0.4 and high > 0.9
