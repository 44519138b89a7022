from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearway.errors import RenderError
from clearway.rooms.camera import View, first_person_view
from clearway.rooms.render import render, studio
from helpers.small_rooms import SmallRoom
from helpers.spread_parts import workers_of

needs_proc = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")

NO_LIBRARY = """
import ctypes, ctypes.util
find, load = ctypes.util.find_library, ctypes.CDLL.__init__
def load_all_but_egl(self, name, *rest, **options):
    if name and "EGL" in name:
        raise OSError(f"{name}: cannot open shared object file: No such file or directory")
    load(self, name, *rest, **options)
ctypes.util.find_library = lambda name: None if name == "EGL" else find(name)
ctypes.CDLL.__init__ = load_all_but_egl
"""


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(0)
    room = SmallRoom()
    for x_m, z_m in rng.uniform(-1, 3, (12, 2)):
        room.add_box((x_m, x_m + 0.2), (z_m, z_m + 0.2), group=2, rgb=tuple(rng.random(3)))
    return room.spec.compile()


@pytest.fixture(scope="module")
def view() -> View:
    return first_person_view(np.repeat([[0.5, 0.5], [1.5, 1.0]], 4, axis=0)[:7], np.arange(7) * 90 % 360)


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_pictures(model, view, capfd):
    alone = render(model, view, workers=1)
    assert alone.shape == (7, 300, 400, 3) and alone.dtype == np.uint8
    assert len({picture.tobytes() for picture in alone}) == 7
    for workers in (2, 3):
        np.testing.assert_array_equal(render(model, view, workers=workers, progress=True), alone)
    assert capfd.readouterr() == ("", "")  # no progress bar where there is no terminal


def test_the_callers_environment_stays_as_it_is(model, view, monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    before = dict(os.environ)
    render(model, view, workers=1)
    assert dict(os.environ) == before


def test_a_missing_egl_library_is_one_line_that_names_the_packages(model, view, tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text(NO_LIBRARY)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert_names_the_packages(model, view)


def test_a_missing_driver_is_one_line_that_names_the_packages(model, view, monkeypatch):
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    assert_names_the_packages(model, view)


def assert_names_the_packages(model, view) -> None:
    with pytest.raises(RenderError, match=r"MUJOCO_GL=egl .*apt-get install libegl1 libgl1 libgl1-mesa-dri") as error:
        render(model, view, workers=2)
    assert "\n" not in str(error.value)


def test_the_users_backend_is_respected_and_named_if_it_fails(model, view, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RenderError, match=r"MUJOCO_GL=glfw .*Unset MUJOCO_GL"):
        render(model, view, workers=1)
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    with pytest.raises(RenderError, match=r"MUJOCO_GL=nonsense .*Unset MUJOCO_GL"):
        render(model, view, workers=1)


@pytest.mark.slow
@needs_proc
def test_a_renderer_that_is_killed_is_one_clear_error_and_ends_the_others(model, view):
    with studio(model, view, workers=2) as camera:
        camera(view.shots)
        os.kill(workers_of(os.getpid())[0], signal.SIGKILL)
        with pytest.raises(RenderError, match=r"renderer process was killed by SIGKILL .*fewer workers") as error:
            for _ in range(20):  # until the one that died is asked
                camera(view.shots)
        assert "\n" not in str(error.value)
    assert not workers_of(os.getpid())


def test_no_pictures_need_no_worker(model):
    empty = first_person_view(np.zeros((0, 2)), np.zeros(0))
    assert render(model, empty).shape == (0, 300, 400, 3)


def test_fewer_than_one_worker_is_refused(model, view):
    with pytest.raises(RenderError, match="ask for 1 or more"):
        render(model, view, workers=0)


@pytest.mark.slow
def test_a_studio_takes_the_same_pictures_a_few_at_a_time(model, view):
    together = render(model, view, workers=1)
    with studio(model, view, workers=2) as camera:
        first = camera(view.shots[:1])
        rest = camera(view.shots[1:])
        nothing = camera(())
    np.testing.assert_array_equal(np.concatenate([first, rest]), together)
    assert nothing.shape == (0, 300, 400, 3)


def test_a_studio_whose_processes_cannot_draw_says_so(model, view, monkeypatch):
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    with studio(model, view, workers=1) as camera, pytest.raises(RenderError, match="apt-get install"):
        camera(view.shots)


def test_a_shot_may_move_the_bodies_that_hang_loose(lit_room):
    model = lit_room
    straight = first_person_view(np.array([[0.5, 0.5]]), np.array([0])).shots[0]
    aside = replace(straight, moved_m=((0.5, 0.0, 0.0),))
    with studio(model, first_person_view(np.zeros((0, 2)), np.zeros(0)), workers=1) as camera:
        ahead, moved = camera((straight, aside))
    assert ahead[150, 200, 0] > 2 * ahead[150, 200, 2]  # red stands in the middle of the picture
    assert moved[150, 200].max() < 30
    assert moved[150, 350, 0] > 2 * moved[150, 350, 2]


@pytest.fixture
def lit_room():
    """A red box 1 m ahead of (0.5, 0.5), on a body of its own; nothing else."""
    spec = SmallRoom().spec
    spec.visual.headlight.ambient[:] = [1, 1, 1]
    body = spec.worldbody.add_body(mocap=True)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0.5, 1.5, 1.0], size=[0.1] * 3, rgba=[0.9, 0.1, 0.1, 1], group=2)
    return spec.compile()
