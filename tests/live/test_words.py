from __future__ import annotations

import pytest

from clearway.errors import ArgumentError
from clearway.live.conditions import REFERENCE, Perturbations
from clearway.live.words import GEOMETRY, perturbations_named


def test_groups_and_names_ask_for_full_strength():
    assert perturbations_named([]) == perturbations_named(["none"]) == Perturbations()
    assert perturbations_named(["all"]) == REFERENCE
    assert perturbations_named(["geometry", "light", "pixel_noise"]) == REFERENCE
    assert GEOMETRY.light == GEOMETRY.pixel_noise == 0 and GEOMETRY.new_obstacle
    for name in REFERENCE.to_json():
        assert perturbations_named([name]) == REFERENCE.alone(name)
        assert perturbations_named([name.replace("_", "-")]) == REFERENCE.alone(name)


def test_a_later_word_changes_what_an_earlier_one_asked_for():
    assert perturbations_named(["camera-pitch-jitter=2", "light=0.5"]) == Perturbations(
        camera_pitch_jitter=2.0, light=0.5
    )
    assert perturbations_named(["all", "light=0", "pixel-noise=0"]) == GEOMETRY
    assert perturbations_named(["light=0.1", "geometry"]).light == 0.1
    assert perturbations_named(["all", "new-obstacle=0"]).new_obstacle is False
    assert perturbations_named(["new-obstacle=1"]) == REFERENCE.alone("new_obstacle")
    assert perturbations_named(["all", "none"]) == Perturbations()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fog"], "perturb='fog': there is none of that name. Choose among none, geometry, all, distance-noise"),
        (["all=1"], "perturb='all=1': there is none of that name"),
        (["light=2"], "perturb='light=2': expected a number from 0 to 1"),
        (["light=-1"], "expected a number from 0 to 1"),
        (["light=nan"], "expected a number from 0 to 1"),
        (["light="], "expected a number from 0 to 1"),
        (["new-obstacle=0.5"], "it is there or not. Write new-obstacle, or new-obstacle=0"),
        ("light", "expected words"),
        ([3], "expected words"),
        (3, "expected words"),
    ],
)
def test_other_words_are_one_error(words, said):
    with pytest.raises(ArgumentError, match=said):
        perturbations_named(words)
