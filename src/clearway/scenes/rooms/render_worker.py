"""One renderer process: reads a job from standard input, writes raw pictures to standard output.

The job is a line of JSON, the view without its shots, a line with the size of the room in bytes, and the room in
MuJoCo's binary format. Then every line is a JSON list of shots to take, until the end. A picture is sent as its bytes
(`View.empty_pictures` says how many), in the order of the shots; a line is read whole before its pictures are written.
`render` starts the process and chooses its OpenGL backend by the environment, which MuJoCo reads when it is imported. A
renderer that does not open is one line on standard error and exit code `CANNOT_DRAW`. When `render` dies, the pipes
break and the process ends.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from itertools import chain, islice
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mujoco

    from clearway.scenes.rooms.camera import Shot, View

CANNOT_DRAW = 3
CANNOT_DRAW_MARK = "cannot draw: "
MODEL_FILE = "room.mjb"


def job_head(view: View, room: bytes) -> bytes:
    """What a process reads first: the lens of a view, and the room as `binary_model` makes it."""
    lens = json.dumps(asdict(replace(view, shots=()))).encode()
    return b"%s\n%d\n%s" % (lens, len(room), room)


def shots_line(shots: Sequence[Shot]) -> bytes:
    """Shots as a line of JSON."""
    return json.dumps([asdict(shot) for shot in shots]).encode() + b"\n"


def _view_of_line(line: bytes) -> View:
    from clearway.scenes.rooms.camera import View

    parts = json.loads(line)
    return View(shots=(), groups=tuple(parts.pop("groups")), **{k: v for k, v in parts.items() if k != "shots"})


def _shots_of_lines(lines: Iterable[bytes]) -> Iterator[Shot]:
    """The shots of all lines, a line at a time."""
    from clearway.scenes.rooms.camera import Shot

    for line in lines:
        for parts in json.loads(line):
            look_at_m, moved_m = tuple(parts.pop("look_at_m")), tuple(map(tuple, parts.pop("moved_m")))
            yield Shot(look_at_m=look_at_m, moved_m=moved_m, **parts)


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
    """Take the pictures that standard input asks for."""
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as output:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a driver prints must not mix with the pictures
        try:
            from clearway.scenes.rooms.camera import take_pictures

            job = sys.stdin.buffer
            view = _view_of_line(job.readline())
            model = model_of_binary(job.read(int(job.readline())))
            pictures = take_pictures(model, view, _shots_of_lines(job))
            first = list(islice(pictures, 1))
        except Exception as error:
            # Missing libraries show as many kinds of error (MuJoCo and PyOpenGL raise AttributeError,
            # ImportError, RuntimeError, ...): `render` makes one RenderError of them all.
            cause = " ".join(f"{type(error).__name__}: {error}".split())
            print(f"{CANNOT_DRAW_MARK}{cause}", file=sys.stderr, flush=True)
            sys.exit(CANNOT_DRAW)
        for picture in chain(first, pictures):
            output.write(picture.tobytes())
            output.flush()


if __name__ == "__main__":
    main()
