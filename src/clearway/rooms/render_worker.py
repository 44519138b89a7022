"""What a renderer process does: it opens a camera in a room once, and takes pictures; and what it needs for that."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.errors import RenderError

if TYPE_CHECKING:
    import mujoco

    from clearway.rooms.camera import Shot

BACKEND_VARIABLE = "MUJOCO_GL"
MESA_THREADS_VARIABLE = "LP_NUM_THREADS"  # of the software rasteriser, in each process
MODEL_FILE = "room.mjb"
REMEDIES = {
    "egl": "On Debian or Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri",
    "osmesa": "On Debian or Ubuntu: apt-get install libosmesa6; or unset MUJOCO_GL",
}
OTHER_REMEDY = "Unset MUJOCO_GL to render without a screen"

Camera = Callable[[Sequence["Shot"]], np.ndarray]
"""From shots to their pictures, (shots, height_px, width_px, 3) uint8 RGB or as `View.empty_pictures` has them."""


def binary_model(model: mujoco.MjModel) -> bytes:
    """The compiled room in MuJoCo's binary format."""
    import mujoco

    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()


def model_of_binary(content: bytes) -> mujoco.MjModel:
    """The room that `binary_model` wrote."""
    import mujoco

    return mujoco.MjModel.from_binary_path(MODEL_FILE, {MODEL_FILE: content})


def open_camera(lens: Mapping[str, Any], room: bytes) -> Camera:
    """A camera in this process, which needs `renderer_environment`.

    Args:
        lens: the fields of a view, all but its shots; as a `View` they could not be read where MuJoCo is broken.
        room: as `binary_model` makes it.

    Raises:
        RenderError: this machine has no OpenGL backend that works; here, or by the camera.
    """
    asked: deque[Shot] = deque()
    with _one_kind_of_error():
        from clearway.rooms.camera import View
        from clearway.rooms.taking import take_pictures

        view = View(shots=(), **lens)
        pictures = take_pictures(model_of_binary(room), view, iter(asked.popleft, None))

    tried = False  # OpenGL opens with the first picture

    def camera(shots: Sequence[Shot]) -> np.ndarray:
        nonlocal tried
        taken = view.empty_pictures(len(shots))
        asked.extend(shots)
        for index in range(len(shots)):
            with nullcontext() if tried else _one_kind_of_error():
                taken[index] = next(pictures)
            tried = True
        return taken

    return camera


def take(camera: Camera, shots: Sequence[Shot]) -> np.ndarray:
    """The pictures of some shots."""
    return camera(shots)


def renderer_environment(threads: int) -> dict[str, str]:
    """What renderer processes get where the caller's environment says nothing: EGL (no screen) on Linux; threads."""
    backend = {BACKEND_VARIABLE: "egl"} if sys.platform == "linux" else {}
    return {MESA_THREADS_VARIABLE: str(threads), **backend}


def cannot_draw(cause: str) -> RenderError:
    """The error for a machine whose OpenGL backend does not open."""
    backend = {**renderer_environment(1), **os.environ}.get(BACKEND_VARIABLE, "")
    remedy = REMEDIES.get(backend.lower().strip(), OTHER_REMEDY)
    words = " ".join(cause.split())
    return RenderError(f"no pictures can be rendered here with {BACKEND_VARIABLE}={backend} ({words}). {remedy}")


@contextmanager
def _one_kind_of_error() -> Iterator[None]:
    """Missing libraries show as many (MuJoCo and PyOpenGL raise AttributeError, ImportError, RuntimeError, ...)."""
    try:
        yield
    except Exception as error:
        raise cannot_draw(f"{type(error).__name__}: {error}") from error
