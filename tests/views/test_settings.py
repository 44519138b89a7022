from __future__ import annotations

import json
from dataclasses import replace

import pytest

from clearway.errors import ArgumentError, ClearwayError
from clearway.live.conditions import Perturbations
from clearway.views.settings import ViewSettings, differing, settings_of


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"poses": 0}, "poses=0: expected 1 to 100000"),
        ({"takes": 101}, "takes=101: expected 1 to 100"),
        ({"seed": -1}, "seed=-1"),
        ({"size_px": (96, 15)}, "size=15: expected 16 to 1024"),
        ({"sensors": ("depth",)}, "leaves out rgb"),
        ({"perturbations": Perturbations()}, "without perturbations all takes of a pose are the same picture"),
        ({"poses": 100_000, "size_px": (1024, 1024)}, "would take 585.9 GiB in memory, expected at most 4"),
    ],
)
def test_impossible_settings_are_one_error(change, said):
    with pytest.raises(ClearwayError, match=said):
        replace(ViewSettings(), **change).check()


def test_sound_settings_are_accepted():
    ViewSettings().check()
    ViewSettings(takes=1, perturbations=Perturbations(), sensors=("depth", "rgb")).check()
    assert [sensor.name for sensor in ViewSettings(sensors=("depth", "rgb")).all_sensors] == ["rgb", "depth"]


def test_what_differs_is_told():
    one = ViewSettings()
    assert differing(one, one) == ""
    other = replace(one, poses=5, held_out=True)
    assert differing(other, one) == "poses 5 instead of 400, held out True instead of False"
    lit = replace(one, perturbations=Perturbations(light=0.1))
    assert differing(lit, one).startswith("distance noise 0.0 instead of 0.05, angle noise 0.0 instead of 5.0")
    assert differing(lit, replace(lit, perturbations=Perturbations(light=0.2))) == "light 0.1 instead of 0.2"


def test_a_record_gives_the_settings_back():
    settings = ViewSettings(5, 3, 2, sensors=("rgb", "depth"), held_out=True)
    assert settings_of(json.loads(json.dumps(settings.to_json()))) == settings


@pytest.mark.parametrize(
    "change",
    [
        {"poses": 2.0},
        {"takes": True},
        {"takes": 10**9},
        {"sensors": 3},
        {"sensors": ["sonar", "rgb"]},
        {"size_px": [16]},
        {"size_px": [16, 10**6]},
        {"perturbations": {"fog": 1}},
        {"perturbations": None},
        {"colour": "red"},
    ],
)
def test_other_records_are_one_error(change):
    with pytest.raises(ArgumentError, match="these are no settings of views"):
        settings_of({**ViewSettings().to_json(), **change})
    with pytest.raises(ArgumentError, match="these are no settings of views"):
        settings_of({})
