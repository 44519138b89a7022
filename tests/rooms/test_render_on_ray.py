"""Rendering on Ray. Slow: starting a cluster takes some ten seconds."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from clearway.errors import RenderError
from clearway.rooms import render as rendering
from clearway.rooms.camera import View, first_person_view
from clearway.rooms.render import render
from helpers.on_ray import MARKS, ray
from helpers.small_rooms import SmallRoom

pytestmark = MARKS


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    rng = np.random.default_rng(0)
    room = SmallRoom()
    for x_m, z_m in rng.uniform(-1, 3, (12, 2)):
        room.add_box((x_m, x_m + 0.2), (z_m, z_m + 0.2), group=2, rgb=tuple(rng.random(3)))
    return room.spec.compile()


@pytest.fixture
def view() -> View:
    whole = first_person_view(np.repeat([[0.5, 0.5]], 5, axis=0), np.arange(5) * 72)
    return replace(whole, height_px=30, width_px=40)


def test_shares_of_a_cluster_make_the_same_pictures(
    model: mujoco.MjModel, view: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rendering, "RAY_SHARE_SHOTS", 2)
    alone = render(model, view, workers=1)
    assert len({picture.tobytes() for picture in alone}) == 5
    assert np.array_equal(render(model, view, ray="local", workers=1), alone)
    assert not ray.is_initialized()


def test_a_node_that_cannot_draw_says_so(model: mujoco.MjModel, view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    with pytest.raises(RenderError, match="apt-get install libegl1"):
        render(model, view, ray="local", workers=1)
