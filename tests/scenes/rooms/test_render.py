from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearway.errors import RenderError
from clearway.scenes.rooms import render as rendering
from clearway.scenes.rooms.camera import View, first_person_view
from clearway.scenes.rooms.render import render, studio
from small_rooms import SmallRoom

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


def test_a_worker_that_dies_ends_the_others_with_one_clear_error(model, view, monkeypatch):
    dying = (
        "import os, signal, sys, time; view = sys.stdin.buffer.read();"
        " sys.stdout.buffer.write(bytes(360_000)); sys.stdout.flush();"
        " os.kill(os.getpid(), signal.SIGKILL) if {first!r} else time.sleep(600)"
    )
    started = []
    start = subprocess.Popen

    def start_stand_in(command, **options):
        process = start([sys.executable, "-c", dying.format(first=not started)], **options)
        started.append(process)
        return process

    monkeypatch.setattr(rendering.subprocess, "Popen", start_stand_in)
    begun = time.monotonic()
    with pytest.raises(RenderError, match=r"signal SIGKILL after 1 of 4 pictures.*fewer workers"):
        render(model, view, workers=2)
    assert time.monotonic() - begun < 60
    assert [process.poll() for process in started] == [-9, -9]


def test_no_process_outlives_a_killed_caller(model, tmp_path):
    script = tmp_path / "caller.py"
    script.write_text(
        f"import sys; sys.path[:] = {[path or os.getcwd() for path in sys.path]!r}\n"
        "import mujoco, numpy as np\n"
        "from clearway.scenes.rooms.camera import first_person_view\n"
        "from clearway.scenes.rooms import render as rendering\n"
        "start = rendering.subprocess.Popen\n"
        "def noted(*args, **options):\n"
        "    process = start(*args, **options)\n"
        "    print(process.pid, flush=True)\n"
        "    return process\n"
        "rendering.subprocess.Popen = noted\n"
        "model = mujoco.MjSpec().compile()\n"
        "rendering.render(model, first_person_view(np.zeros((1000, 2)), np.zeros(1000)), workers=2)\n"
    )
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as caller:
        workers = [int(caller.stdout.readline()) for _ in range(2)]
        caller.kill()
    deadline = time.monotonic() + 30
    while any(is_running(worker) for worker in workers):
        assert time.monotonic() < deadline, "a renderer process is still running"
        time.sleep(0.05)


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_no_pictures_need_no_worker(model):
    empty = first_person_view(np.zeros((0, 2)), np.zeros(0))
    assert render(model, empty).shape == (0, 300, 400, 3)


def test_fewer_than_one_worker_is_refused(model, view):
    with pytest.raises(RenderError, match="ask for 1 or more"):
        render(model, view, workers=0)


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
