"""Take all pictures of a room on all cores, one renderer process a core.

Each process gets the compiled room (its light is baked once, by the caller) and every n-th shot, and sends its
pictures back through a pipe. The processes are plain subprocesses: their environment names MuJoCo's OpenGL
backend, so that the caller's own stays as it is, and a script needs no `if __name__ == "__main__"`.
"""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import IO, TYPE_CHECKING

import numpy as np

from clearway.errors import RenderError
from clearway.progress import picture_progress
from clearway.scenes.rooms.render_worker import CANNOT_DRAW, CANNOT_DRAW_MARK, binary_model, view_line

if TYPE_CHECKING:
    import mujoco

    from clearway.scenes.rooms.camera import View

BACKEND_VARIABLE = "MUJOCO_GL"
MESA_THREADS_VARIABLE = "LP_NUM_THREADS"  # of the software rasteriser, in each process
MOST_WORKERS = 16  # each holds the whole room in memory
WORKER_COMMAND = "import sys; sys.path[:] = {path!r}; from {module} import main; main()"
WORKER_MODULE = "clearway.scenes.rooms.render_worker"
REMEDIES = {
    "egl": "On Debian or Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri",
    "osmesa": "On Debian or Ubuntu: apt-get install libosmesa6; or unset MUJOCO_GL",
}
OTHER_REMEDY = "Unset MUJOCO_GL to render without a screen"


def render(
    model: mujoco.MjModel,
    view: View,
    *,
    workers: int | None = None,
    progress: bool = False,
    label: str = "rendering",
) -> np.ndarray:
    """The pictures of a view, (shots, height_px, width_px, 3) uint8 RGB, the same for any number of workers.

    Args:
        model: the compiled room.
        view: the pictures to take.
        workers: number of processes; None: one a core.
        progress: show a progress bar, if standard error is a terminal.
        label: what the progress bar says.

    Raises:
        RenderError: this machine has no OpenGL backend that works, or a renderer process died.
    """
    if workers is not None and workers < 1:
        raise RenderError(f"{workers} renderer processes cannot render; ask for 1 or more")
    count = min(workers or _core_count(), MOST_WORKERS, len(view.shots))
    pictures = np.empty((len(view.shots), view.height_px, view.width_px, 3), np.uint8)
    room = binary_model(model)
    with (
        picture_progress(label, len(pictures), progress) as show_done,
        _started_workers(count) as started,
        ThreadPoolExecutor(max(count, 1)) as threads,
    ):
        numbers = itertools.count(1)

        def advance() -> None:
            show_done(next(numbers))

        try:
            jobs = []
            for first, worker in enumerate(started):
                share = replace(view, shots=view.shots[first::count])
                jobs.append(threads.submit(worker.fill, pictures[first::count], share, room, advance))
            done, _ = wait(jobs, return_when=FIRST_EXCEPTION)
            for job in done:
                job.result()
        finally:
            for worker in started:
                worker.process.kill()  # the threads then find their pipes at an end
    return pictures


def _core_count() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _worker_environment(workers: int) -> dict[str, str]:
    """The caller's environment; what it leaves open: EGL (no screen) on Linux, and no more threads than cores."""
    environment = dict(os.environ)
    environment.setdefault(MESA_THREADS_VARIABLE, str(max(1, _core_count() // workers)))
    if sys.platform == "linux":
        environment.setdefault(BACKEND_VARIABLE, "egl")
    return environment


@dataclass(frozen=True)
class _Worker:
    """A renderer process and the file that holds its standard error."""

    process: subprocess.Popen[bytes]
    messages: IO[bytes]

    @classmethod
    def start(cls, messages: IO[bytes], environment: dict[str, str]) -> _Worker:
        """A process that waits for its job and writes its standard error to `messages`."""
        path = [folder or os.getcwd() for folder in sys.path]
        process = subprocess.Popen(
            [sys.executable, "-c", WORKER_COMMAND.format(path=path, module=WORKER_MODULE)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=messages,
            env=environment,
        )
        return cls(process, messages)

    def fill(self, pictures: np.ndarray, view: View, room: bytes, advance: Callable[[], None]) -> None:
        """Take the pictures of `view` into `pictures`, (shots, height_px, width_px, 3) uint8.

        Args:
            pictures: what to fill.
            view: the share of this worker.
            room: the model as `binary_model` makes it.
            advance: called after each picture.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            with self.process.stdin as stdin:
                stdin.write(view_line(view))
                stdin.write(room)
        except BrokenPipeError:
            raise self._failure(0, len(pictures)) from None
        size = view.height_px * view.width_px * 3
        for index in range(len(pictures)):
            raw = self.process.stdout.read(size)
            if len(raw) < size:
                raise self._failure(index, len(pictures))
            pictures[index] = np.frombuffer(raw, np.uint8).reshape(pictures.shape[1:])
            advance()
        if self.process.wait() != 0:
            raise self._failure(len(pictures), len(pictures))

    def close(self) -> None:
        """End the process if it still runs, and close its pipes."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                stream.close()

    def _failure(self, taken: int, asked: int) -> RenderError:
        """What went wrong in a process that ended early, as an error to raise."""
        code = self.process.wait()
        self.messages.seek(0)
        lines = self.messages.read().decode(errors="replace").strip().splitlines() or [""]
        if code == CANNOT_DRAW:
            marked = [line for line in lines if line.startswith(CANNOT_DRAW_MARK)] or lines
            return cannot_draw(marked[0].removeprefix(CANNOT_DRAW_MARK))
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return RenderError(
            f"a renderer process ended with {how} after {taken} of {asked} pictures: "
            f"{lines[-1] or 'it left no message'}. Try fewer workers, which need less memory"
        )


@contextmanager
def _started_workers(count: int) -> Iterator[list[_Worker]]:
    """Renderer processes, ended and closed on the way out."""
    with ExitStack() as stack:
        workers: list[_Worker] = []
        for _ in range(count):
            messages = stack.enter_context(tempfile.TemporaryFile())
            workers.append(_Worker.start(messages, _worker_environment(count)))
            stack.callback(workers[-1].close)
        yield workers


def cannot_draw(cause: str) -> RenderError:
    """The error for a machine whose OpenGL backend does not open."""
    backend = _worker_environment(1).get(BACKEND_VARIABLE, "")
    remedy = REMEDIES.get(backend.lower().strip(), OTHER_REMEDY)
    return RenderError(f"no pictures can be rendered here with {BACKEND_VARIABLE}={backend} ({cause}). {remedy}")
