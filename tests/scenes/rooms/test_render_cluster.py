"""Rendering on a cluster: by a stand-in for Ray that does a task when its result is asked for, and, slowly, by Ray."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from clearway.errors import RenderError
from clearway.scenes.rooms import render_cluster
from clearway.scenes.rooms.camera import View, first_person_view
from clearway.scenes.rooms.render import render
from clearway.scenes.rooms.render_cluster import render_at
from small_rooms import SmallRoom

os.environ.update(RAY_USAGE_STATS_ENABLED="0", RAY_AUTH_MODE="token", RAY_AUTH_TOKEN="for-this-test-alone-0123456789")


class RayError(Exception):
    """A worker died."""


class RayTaskError(RayError):
    """A task raised an error."""

    def __init__(self, cause: Exception) -> None:
        super().__init__(str(cause))
        self.cause = cause


class StandIn:
    """As much of Ray as rendering uses."""

    exceptions = SimpleNamespace(RayError=RayError, RayTaskError=RayTaskError)

    def __init__(self, dies: bool = False) -> None:
        self.dies, self.tasks = dies, 0

    def put(self, value: bytes) -> bytes:
        return value

    def remote(self, num_cpus: int) -> Callable[[Callable[..., Any]], Any]:
        assert num_cpus == 1
        return lambda task: SimpleNamespace(remote=lambda *args: lambda: task(*args))

    def get(self, reference: Callable[[], Any]) -> Any:
        self.tasks += 1
        if self.dies:
            raise RayError("The node was terminated.\nMore about it.")
        try:
            return reference()
        except RenderError as error:
            raise RayTaskError(error) from error


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


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> StandIn:
    ray = StandIn()

    @contextmanager
    def connected(address: str, cores: int | None) -> Iterator[StandIn]:
        assert (address, cores) == ("auto", 3)
        yield ray

    monkeypatch.setattr(render_cluster, "connected", connected)
    monkeypatch.setattr(render_cluster, "SHARE_SHOTS", 2)
    return ray


def test_shares_of_a_cluster_make_the_same_pictures(model: mujoco.MjModel, view: View, stand_in: StandIn) -> None:
    alone = render_at(None, model, view, workers=1)
    assert len({picture.tobytes() for picture in alone}) == 5
    assert np.array_equal(render_at("auto", model, view, workers=3), alone)
    assert stand_in.tasks == 3


def test_a_node_that_died_is_one_line(model: mujoco.MjModel, view: View, stand_in: StandIn) -> None:
    stand_in.dies = True
    with pytest.raises(RenderError, match=r"died \(The node was terminated\.\)\. Run the command again"):
        render_at("auto", model, view, workers=3)


def test_a_node_that_cannot_draw_says_so(
    model: mujoco.MjModel, view: View, stand_in: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    with pytest.raises(RenderError, match="apt-get install libegl1"):
        render_at("auto", model, view, workers=3)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_ray_makes_the_same_pictures(model: mujoco.MjModel, view: View) -> None:
    ray = pytest.importorskip("ray")
    assert np.array_equal(render_at("local", model, view, workers=1), render(model, view, workers=1))
    assert not ray.is_initialized()
