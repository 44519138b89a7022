import numpy as np
import pytest

from clearway.evaluation.bootstrap import intervals, resampled_by_target


@pytest.mark.slow
def test_intervals_of_a_mean_agree_with_normal_theory():
    values = np.random.default_rng(1).normal(50, 7, (400, 1))
    low, high = intervals(resampled_by_target(values, np.ones((400, 1)), np.zeros(400, int), resamples=20_000))[:, 0, 0]
    half = 1.96 * values.std() / np.sqrt(400)
    assert abs(low - (values.mean() - half)) < 0.05 * half
    assert abs(high - (values.mean() + half)) < 0.05 * half


def test_resampling_is_stratified():
    # Two targets that differ in everything but not within themselves leave nothing to chance.
    target = np.repeat([0, 1], [5, 50])
    values = np.where(target == 0, 1.0, 9.0)[:, None]
    drawn = resampled_by_target(values, np.ones_like(values), target, resamples=100)
    assert (drawn[:, 0] == 1).all() and (drawn[:, 1] == 9).all()


def test_a_quotient_is_resampled_as_a_quotient():
    rng = np.random.default_rng(0)
    denominator = rng.uniform(1, 100, (60, 1))
    drawn = resampled_by_target(3 * denominator, denominator, np.zeros(60, int), resamples=50)
    assert np.allclose(drawn, 3)


def test_coverage_of_the_mean_is_near_95_percent():
    rng = np.random.default_rng(2)
    hits = 0
    for _ in range(300):
        sample = rng.exponential(1, (60, 1))
        low, high = intervals(resampled_by_target(sample, np.ones((60, 1)), np.zeros(60, int), resamples=300))[:, 0, 0]
        hits += low <= 1 <= high
    assert 0.88 <= hits / 300 <= 0.985


def test_a_seed_repeats():
    values, one, target = np.arange(20.0)[:, None], np.ones((20, 1)), np.zeros(20, int)
    first, again, other = (resampled_by_target(values, one, target, seed=s) for s in (3, 3, 4))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
