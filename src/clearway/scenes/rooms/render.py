"""Take all pictures of a room on all cores, one renderer process a core; or a few at a time, in a `studio`.

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
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING

import numpy as np

from clearway.errors import RenderError
from clearway.progress import picture_progress
from clearway.scenes.rooms.render_worker import CANNOT_DRAW, CANNOT_DRAW_MARK, binary_model, job_head, shots_line

if TYPE_CHECKING:
    import mujoco

    from clearway.scenes.rooms.camera import Shot, View

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

Camera = Callable[[Sequence["Shot"]], np.ndarray]
"""From shots to their pictures, (shots, height_px, width_px, 3) uint8 RGB or as `View.empty_pictures` has them."""


def render(
    model: mujoco.MjModel,
    view: View,
    *,
    workers: int | None = None,
    progress: bool = False,
    label: str = "rendering",
) -> np.ndarray:
    """The pictures of a view, as its `empty_pictures` has them, the same for any number of workers.

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
    pictures = view.empty_pictures(len(view.shots))
    head = job_head(view, binary_model(model))
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
                share = pictures[first::count], view.shots[first::count]
                jobs.append(threads.submit(worker.do_job, head, *share, advance))
            done, _ = wait(jobs, return_when=FIRST_EXCEPTION)
            for job in done:
                job.result()
        finally:
            for worker in started:
                worker.process.kill()  # the threads then find their pipes at an end
    return pictures


@contextmanager
def studio(model: mujoco.MjModel, view: View, *, workers: int | None = None) -> Iterator[Camera]:
    """Renderer processes that stay open for the block, to take pictures of one room again and again.

    Args:
        model: the compiled room.
        view: the lens; its own shots are not taken.
        workers: number of processes; None: one a core.

    Yields:
        A function from shots to their pictures (`View.empty_pictures`); it raises what `render` raises.
    """
    count = min(workers or _core_count(), MOST_WORKERS)
    head = job_head(view, binary_model(model))
    with _started_workers(count) as started, ThreadPoolExecutor(count) as threads:

        def take(shots: Sequence[Shot]) -> np.ndarray:
            pictures = view.empty_pictures(len(shots))
            jobs = [
                threads.submit(worker.take, pictures[first::count], shots[first::count], _nothing)
                for first, worker in enumerate(started)
            ]
            for job in jobs:
                job.result()
            return pictures

        try:
            for worker in started:
                worker.begin(head)
            yield take
        finally:
            for worker in started:
                worker.process.kill()  # the threads then find their pipes at an end


def take_alone(head: bytes, pictures: np.ndarray, shots: Sequence[Shot]) -> None:
    """Fill pictures (`View.empty_pictures`) by one renderer process with one thread.

    Args:
        head: lens and room, see `job_head`.
        pictures: what to fill.
        shots: to be taken.

    Raises:
        RenderError: as of `render`.
    """
    with _started_workers(1, threads=1) as (worker,):
        worker.do_job(head, pictures, shots, _nothing)


def _nothing() -> None:
    """Called after each picture where nobody counts them."""


def _core_count() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _worker_environment(threads: int) -> dict[str, str]:
    """The caller's environment; what it leaves open: EGL (no screen) on Linux, and so many threads a process."""
    environment = dict(os.environ)
    environment.setdefault(MESA_THREADS_VARIABLE, str(threads))
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

    def do_job(self, head: bytes, pictures: np.ndarray, shots: Sequence[Shot], advance: Callable[[], None]) -> None:
        """Begin, take all pictures, and end; see `begin` and `take`."""
        self.begin(head)
        self.take(pictures, shots, advance, last=True)
        if self.process.wait() != 0:
            raise self._failure(len(pictures), len(pictures))

    def begin(self, head: bytes) -> None:
        """Send the lens and the room (`job_head`)."""
        self._send(head, 0)

    def take(
        self, pictures: np.ndarray, shots: Sequence[Shot], advance: Callable[[], None], *, last: bool = False
    ) -> None:
        """Take the pictures of some shots.

        Args:
            pictures: what to fill, see `View.empty_pictures`.
            shots: the share of this worker.
            advance: called after each picture.
            last: no more shots will follow.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        self._send(shots_line(shots), len(pictures))
        if last:
            self.process.stdin.close()
        size = pictures[0].nbytes if len(pictures) else 0
        for index in range(len(pictures)):
            raw = self.process.stdout.read(size)
            if len(raw) < size:
                raise self._failure(index, len(pictures))
            pictures[index] = np.frombuffer(raw, pictures.dtype).reshape(pictures.shape[1:])
            advance()

    def _send(self, message: bytes, asked: int) -> None:
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(message)
            self.process.stdin.flush()
        except BrokenPipeError:
            raise self._failure(0, asked) from None

    def close(self) -> None:
        """End the process if it still runs, and close its pipes."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with suppress(BrokenPipeError):  # a process that died left something unread
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
def _started_workers(count: int, threads: int | None = None) -> Iterator[list[_Worker]]:
    """Renderer processes, ended and closed on the way out; by default no more threads than cores in all."""
    threads = threads or max(1, _core_count() // max(count, 1))
    with ExitStack() as stack:
        workers: list[_Worker] = []
        for _ in range(count):
            messages = stack.enter_context(tempfile.TemporaryFile())
            workers.append(_Worker.start(messages, _worker_environment(threads)))
            stack.callback(workers[-1].close)
        yield workers


def cannot_draw(cause: str) -> RenderError:
    """The error for a machine whose OpenGL backend does not open."""
    backend = _worker_environment(1).get(BACKEND_VARIABLE, "")
    remedy = REMEDIES.get(backend.lower().strip(), OTHER_REMEDY)
    return RenderError(f"no pictures can be rendered here with {BACKEND_VARIABLE}={backend} ({cause}). {remedy}")
