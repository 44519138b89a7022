"""One renderer process: reads a job from standard input, writes raw pictures to standard output.

The job is a pickled `View` and a pickled `MjModel`. Each picture is height x width x 3 bytes, in the order of the
view's shots. `render` starts the process and chooses its OpenGL backend by the environment, which MuJoCo
reads when it is imported. A renderer that does not open is one line on standard error and exit code
`CANNOT_DRAW`. When `render` dies, the pipes break and the process ends.
"""

from __future__ import annotations

import os
import pickle
import sys
from itertools import chain

CANNOT_DRAW = 3
CANNOT_DRAW_MARK = "cannot draw: "


def main() -> None:
    """Take the pictures of the job on standard input."""
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as output:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a driver prints must not mix with the pictures
        try:
            from clearway.scenes.rooms.camera import take_pictures

            view, model = pickle.load(sys.stdin.buffer), pickle.load(sys.stdin.buffer)
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
