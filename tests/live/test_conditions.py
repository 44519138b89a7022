from __future__ import annotations

import numpy as np
import pytest

from clearway.live.conditions import MOST, REFERENCE, Perturbations, label_of, sweep_settings
from clearway.live.draws import Draws

GREY = np.full((20, 30, 3), 100, np.uint8)


def test_a_sweep_has_every_perturbation_alone_and_all_together_at_every_strength():
    settings = sweep_settings((0.5, 1.0))
    assert len(settings) == 1 + 7 * 2 + 1 + 2  # none, seven magnitudes, the new obstacle, all
    assert settings[0].perturbations == Perturbations()
    assert settings[1].label == "move ± 0.025 m" and settings[2].label == "move ± 0.05 m"
    assert settings[1].perturbations == Perturbations(distance_noise=0.025)
    assert settings[-3].perturbations == Perturbations(new_obstacle=True)
    assert settings[-1].perturbations == REFERENCE
    assert settings[-2].perturbations.move_furniture == pytest.approx(0.15)
    assert settings[-2].perturbations.new_obstacle
    assert len({setting.label for setting in settings}) == len(settings)


def test_labels_name_what_is_changed():
    assert label_of(Perturbations()) == "none"
    assert label_of(Perturbations(light=0.3, new_obstacle=True)) == "light ± 30%, new obstacle"


def test_every_magnitude_has_a_most_that_full_strength_keeps_to():
    assert MOST.keys() == {name for name, value in REFERENCE.to_json().items() if not isinstance(value, bool)}
    assert REFERENCE.too_strong is None and Perturbations(**MOST).too_strong is None
    for name, most in MOST.items():
        assert Perturbations(**{name: 1.01 * most}).too_strong == name


def test_light_is_one_factor_an_episode_within_its_range():
    factors = [Draws(seed, Perturbations(light=0.3)).brightness for seed in range(200)]
    assert 0.7 <= min(factors) < 0.72 and 1.28 < max(factors) <= 1.3
    draws = Draws(5, Perturbations(light=0.3))
    expected = np.uint8(np.rint(100 * draws.brightness))
    assert (draws.seen(GREY) == expected).all() and (draws.seen(GREY) == expected).all()


def test_pixel_noise_has_its_standard_deviation_and_changes_from_picture_to_picture():
    draws = Draws(-7, Perturbations(pixel_noise=10.0))
    first, second = draws.seen(GREY), draws.seen(GREY)
    assert first.astype(float).std() == pytest.approx(10, rel=0.1)
    assert first.astype(float).mean() == pytest.approx(100, abs=1)
    assert (first != second).any()
    np.testing.assert_array_equal(Draws(-7, Perturbations(pixel_noise=10.0)).seen(GREY), first)


def test_nothing_changed_leaves_the_picture_alone():
    assert Draws(0, Perturbations()).seen(GREY) is GREY


def test_errors_are_normal_and_each_kind_draws_for_itself():
    every = Draws(3, REFERENCE)
    lengths_m = [every.distance_error_m() for _ in range(500)]
    assert np.std(lengths_m) == pytest.approx(0.05, rel=0.15) and abs(np.mean(lengths_m)) < 0.01
    alone = Draws(3, REFERENCE.alone("angle_noise"))
    assert [every.angle_error_deg() for _ in range(3)] == [alone.angle_error_deg() for _ in range(3)]
    assert alone.distance_error_m() == alone.height_error_m() == alone.pitch_error_deg() == 0
