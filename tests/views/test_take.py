"""Pictures are of the poses in the table, under the light and noise of their draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.live.conditions import Perturbations
from clearway.rooms.camera import eye_view, first_person_shot
from clearway.rooms.render import render
from clearway.rooms.sense import sense
from clearway.views import take
from clearway.views.poses import draw_takes
from clearway.views.settings import ViewSettings
from clearway.views.take import room_views

SETTINGS = ViewSettings(
    poses=3,
    takes=2,
    sensors=("depth", "rgb"),
    size_px=(24, 32),
    perturbations=Perturbations(camera_height_jitter=0.1, distance_noise=0.05),
)


@pytest.fixture(autouse=True)
def _small_room(live, monkeypatch) -> None:
    def sense_in_a_process(*given, here: bool, **options):
        """Rendering in a process that has loaded PyTorch, as this one has, may crash."""
        assert here
        return sense(*given, workers=1, **options)

    monkeypatch.setattr(take, "live_room", lambda scene, **options: live)
    monkeypatch.setattr(take, "sense", sense_in_a_process)


def test_pictures_are_of_the_poses_in_the_table(live) -> None:
    views = room_views(live.scene, SETTINGS)
    table = views.table
    assert views.rgb.shape == (6, 24, 32, 3) and [one.sensor.name for one in views.further] == ["depth"]
    shots = [
        first_person_shot(x_m, z_m, heading_deg, height_m=height_m)
        for x_m, z_m, heading_deg, height_m in zip(table.x_m, table.z_m, table.heading_deg, table.height_m, strict=True)
    ]
    for sensor, seen in (("rgb", views.rgb), ("depth", views.further[0].raw)):
        view = replace(eye_view(shots, height_px=24, width_px=32, fast=True), sensor=sensor)
        np.testing.assert_array_equal(render(live.model, view, workers=1), seen)


@pytest.mark.slow
def test_light_and_noise_are_those_of_the_draws(live) -> None:
    """As live agents see them; nothing else changes."""
    clean = room_views(live.scene, SETTINGS)
    perturbed = replace(SETTINGS, perturbations=replace(SETTINGS.perturbations, light=0.5, pixel_noise=5.0))
    views = room_views(live.scene, perturbed)
    np.testing.assert_array_equal(views.table.to_array(), clean.table.to_array())
    np.testing.assert_array_equal(views.further[0].raw, clean.further[0].raw)
    draws = draw_takes(live, live.scene.held_out, perturbed).draws
    assert len({one.brightness for one in draws}) == 6
    for seen, plain, own in zip(views.rgb, clean.rgb, draws, strict=True):
        np.testing.assert_array_equal(seen, own.seen(plain))
        assert (seen != plain).mean() > 0.3


@pytest.mark.slow
def test_odd_sizes_are_taken_too(live) -> None:
    assert room_views(live.scene, replace(SETTINGS, size_px=(17, 31))).rgb.shape == (6, 17, 31, 3)
