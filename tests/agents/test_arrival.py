"""Whether what is seen is the target, by likeness."""

import numpy as np
import pytest

from clearway.agents.arrival import MOST, Arrival, arrival_of_json, fitted_arrival, likeness

RNG = np.random.default_rng(0)


def at_degrees(*angles: float) -> np.ndarray:
    """Rows of two numbers, at angles; of different lengths."""
    radians = np.radians(angles)
    return (
        np.stack([np.cos(radians), np.sin(radians)], axis=1).astype(np.float32) * np.arange(1, len(angles) + 1)[:, None]
    )


def test_likeness_is_the_cosine_whatever_the_lengths() -> None:
    np.testing.assert_allclose(likeness(at_degrees(0, 0, 0), at_degrees(0, 60, 180)), [1, 0.5, -1], atol=1e-6)
    assert likeness(np.zeros((1, 2)), at_degrees(0)) == 0


def test_the_threshold_is_a_quantile_of_the_likeness_of_the_nearest_other() -> None:
    features = at_degrees(0, 10, 30, 90)  # nearest others are 10, 10, 20, 60 degrees away
    nearest = np.cos(np.radians([10, 10, 20, 60]))
    for quantile in (0.0, 0.5, 1.0):
        found = fitted_arrival(features, 2, quantile)
        assert found.threshold == pytest.approx(np.quantile(nearest, quantile), abs=1e-6)
    told = fitted_arrival(features, 2, 0.5)(at_degrees(0, 16, 30), at_degrees(0, 0, 0))
    assert told.tolist() == [True, False, False]  # between 10 and 20 degrees


def test_only_the_first_numbers_are_compared() -> None:
    features = np.concatenate([at_degrees(0, 90, 180), RNG.normal(size=(3, 5)) * 100], axis=1)
    assert fitted_arrival(features, 2, 0.5).threshold == pytest.approx(0, abs=1e-6)
    assert Arrival(0.9, 2)(features, features[:, :2]).all()


def test_the_same_picture_in_two_poses_is_no_other() -> None:
    features = at_degrees(0, 0, 60, 120)
    assert fitted_arrival(features, 2, 1.0).threshold == pytest.approx(0.5, abs=1e-6)
    assert fitted_arrival(at_degrees(5, 5, 5), 2) is None
    assert fitted_arrival(at_degrees(5), 2) is None


def test_a_threshold_leaves_room_for_the_last_bits() -> None:
    assert fitted_arrival(at_degrees(0, 0.2), 2, 1.0).threshold == MOST


def test_many_poses_are_compared_in_parts() -> None:
    features = RNG.normal(size=(2_500, 8)).astype(np.float32)
    unit = features / np.linalg.norm(features, axis=1, keepdims=True)
    alike = unit @ unit.T
    np.fill_diagonal(alike, -1)
    assert fitted_arrival(features, 8, 0.7).threshold == pytest.approx(np.quantile(alike.max(axis=1), 0.7), abs=1e-6)


def test_it_comes_back_from_json_or_is_refused() -> None:
    kept = Arrival(0.75, 128)
    assert arrival_of_json(kept.to_json(), 3_200) == kept
    for wrong in (
        {},
        {"threshold": 0.5},
        {"threshold": "0.5", "numbers": 3},
        {"threshold": 2.0, "numbers": 3},
        {"threshold": float("nan"), "numbers": 3},
        {"threshold": 0.5, "numbers": 0},
        {"threshold": 0.5, "numbers": 9},
        {"threshold": 0.5, "numbers": 3, "more": 1},
    ):
        with pytest.raises(ValueError, match="arrival is"):
            arrival_of_json(wrong, 8)
