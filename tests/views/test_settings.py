from __future__ import annotations

from dataclasses import replace

import pytest

from clearway.errors import ClearwayError
from clearway.live.conditions import Perturbations
from clearway.views.settings import ViewSettings, differing


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
    one = ViewSettings().to_json()
    assert differing(one, one) == ""
    other = replace(ViewSettings(), poses=5, held_out=True).to_json()
    assert differing(other, one) == "poses 5 instead of 400, held out True instead of False"
    lit = replace(ViewSettings(), perturbations=Perturbations(light=0.1)).to_json()
    assert differing(lit, one).startswith("perturbations {")
    assert differing({}, one).startswith("poses None instead of 400")
