"""One renderer process: reads a job from standard input, writes raw pictures to standard output.

The job is a line of JSON, the view, and then the room in MuJoCo's binary format up to the end. Each picture is height x
width x 3 bytes, in the order of the view's shots. `render` starts the process and chooses its OpenGL backend by the
environment, which MuJoCo reads when it is imported. A renderer that does not open is one line on standard error and
exit code `CANNOT_DRAW`. When `render` dies, the pipes break and the process ends.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import asdict
from itertools import chain
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mujoco

    from clearway.scenes.rooms.camera import View

CANNOT_DRAW = 3
CANNOT_DRAW_MARK = "cannot draw: "
MODEL_FILE = "room.mjb"


def view_line(view: View) -> bytes:
    """The view as a line of JSON."""
    return json.dumps(asdict(view)).encode() + b"\n"


def view_of_line(line: bytes) -> View:
    """The view that `view_line` wrote."""
    from clearway.scenes.rooms.camera import Shot, View

    parts = json.loads(line)
    shots = tuple(Shot(**{**shot, "look_at_m": tuple(shot["look_at_m"])}) for shot in parts.pop("shots"))
    return View(shots=shots, groups=tuple(parts.pop("groups")), **parts)


def binary_model(model: mujoco.MjModel) -> bytes:
    """The compiled room in MuJoCo's binary format."""
    import mujoco
    import numpy as np

    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()


def model_of_binary(content: bytes) -> mujoco.MjModel:
    """The room that `binary_model` wrote."""
    import mujoco

    return mujoco.MjModel.from_binary_path(MODEL_FILE, {MODEL_FILE: content})


def main() -> None:
    """Take the pictures of the job on standard input."""
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as output:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a driver prints must not mix with the pictures
        try:
            from clearway.scenes.rooms.camera import take_pictures

            view = view_of_line(sys.stdin.buffer.readline())
            model = model_of_binary(sys.stdin.buffer.read())
            pictures = take_pictures(model, view)
            first = next(pictures)
        except Exception as error:
            # Missing libraries show as many kinds of error (MuJoCo and PyOpenGL raise AttributeError,
            # ImportError, RuntimeError, ...): `render` makes one RenderError of them all.
            cause = " ".join(f"{type(error).__name__}: {error}".split())
            print(f"{CANNOT_DRAW_MARK}{cause}", file=sys.stderr, flush=True)
            sys.exit(CANNOT_DRAW)
        for picture in chain([first], pictures):
            output.write(picture.tobytes())
            output.flush()


if __name__ == "__main__":
    main()
