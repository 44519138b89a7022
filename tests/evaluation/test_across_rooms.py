"""Ratios over rooms, and how sure they are."""

from itertools import product

import numpy as np
import pytest

from clearway.evaluation import across_rooms
from clearway.evaluation.across_rooms import ratio_estimate, sign_flip_p

ROOMS = np.array([100.0, 1_000.0, 20.0, 7.0, 300.0, 50.0])


def test_a_ratio_that_all_rooms_have_is_certain_however_they_differ() -> None:
    found = ratio_estimate(ROOMS / 2, ROOMS)
    assert found.value == pytest.approx(0.5) and found.interval == pytest.approx((0.5, 0.5))
    assert sign_flip_p(ROOMS / 2, ROOMS) == 2 / 2**6  # no other signs say as much, but all turned round


def test_the_mean_is_geometric() -> None:
    found = ratio_estimate(np.array([4.0, 1.0]), np.array([1.0, 4.0]))
    assert found.value == pytest.approx(1) and found.interval is not None
    assert found.interval[0] * found.interval[1] == pytest.approx(1, rel=0.1)
    assert sign_flip_p(np.array([4.0, 1.0]), np.array([1.0, 4.0])) == 1


def test_p_counts_the_signs_that_say_as_much() -> None:
    logs = np.array([0.5, 0.3, -0.2, 0.4, 0.1, 0.6, 0.25])
    means = [abs(np.dot(signs, logs)) for signs in product((1, -1), repeat=7)]
    expected = np.mean(np.array(means) >= abs(logs.sum()) - 1e-12)
    assert sign_flip_p(np.exp(logs), np.ones(7)) == pytest.approx(expected)
    assert sign_flip_p(np.exp(-logs), np.ones(7)) == pytest.approx(expected)  # two-sided


def test_what_counts_as_equal_is_taken_off() -> None:
    assert sign_flip_p(1.02 * ROOMS, ROOMS, allowed=1.02) == 1
    assert sign_flip_p(ROOMS, ROOMS, allowed=1.02) == 2 / 2**6


def test_up_to_sixteen_rooms_it_is_exact() -> None:
    assert sign_flip_p(np.ones(16), np.full(16, 2.0)) == 2 / 2**16


def test_of_many_rooms_signs_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    rooms = np.exp(rng.normal(0.2, 0.4, 12))
    exact = sign_flip_p(rooms, np.ones(12))
    monkeypatch.setattr(across_rooms, "EXACT_ROOMS", 11)
    assert sign_flip_p(rooms, np.ones(12)) == pytest.approx(exact, abs=0.01)
    assert sign_flip_p(rooms, np.ones(12)) == sign_flip_p(rooms, np.ones(12)) > 0
