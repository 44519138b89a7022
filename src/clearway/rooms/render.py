"""Take all pictures of a room on all cores or on a Ray cluster; or a few at a time, in a `studio`.

Each renderer process gets the compiled room (its light is baked once, by the caller) and share after share of the
shots. Its environment names MuJoCo's OpenGL backend, so that the caller's own stays as it is. Every node of a cluster
must be able to render.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import RenderError
from clearway.progress import work_progress
from clearway.rooms.render_worker import Camera, binary_model, open_camera, renderer_environment, take
from clearway.spread.workers import Work, Workers, core_count, workers_for

if TYPE_CHECKING:
    import mujoco

    from clearway.rooms.camera import Shot, View

MOST_WORKERS = 16  # each holds the whole room in memory
SHARE_SHOTS = 8  # pictures that a process takes at a time; less, and it waits
RAY_SHARE_SHOTS = 100  # on a cluster, some seconds


def render(
    model: mujoco.MjModel,
    view: View,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: bool = False,
    label: str = "rendering",
    here: bool = False,
) -> np.ndarray:
    """The pictures of a view, as its `empty_pictures` has them, the same whoever takes them.

    Args:
        model: the compiled room.
        view: the pictures to take.
        workers: number of processes, None for one a core; under Ray's "local" processors, None for all.
        ray: a Ray cluster that renders instead, see `ray_cluster.connected`.
        progress: show a progress bar, if standard error is a terminal.
        label: what the progress bar says.
        here: this process renders, and needs `renderer_environment`; workers and ray do not count.

    Raises:
        RenderError: a machine has no OpenGL backend that works, or a renderer process died.
        RunError: Ray is not installed, or the cluster cannot be reached.
    """
    pictures = view.empty_pictures(len(view.shots))
    count = None if ray is not None or here else process_count(workers, len(pictures))
    workers, ray = (None, None) if here else (count or workers, ray)
    size = RAY_SHARE_SHOTS if count is None else _share_size(len(pictures), count)
    with (
        work_progress(label, len(pictures), progress) as show_done,
        workers_for(_work(model, view, count), workers=workers, ray=ray) as crew,
    ):
        done = 0
        for share in crew.results(_shares(view.shots, size)):
            pictures[done : done + len(share)] = share
            done += len(share)
            show_done(done)
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
    count = process_count(workers, MOST_WORKERS)
    nothing = view.empty_pictures(0)
    with photographers(model, view, workers=workers) as crew:
        yield lambda shots: np.concatenate(
            [nothing, *crew.results(_shares(tuple(shots), _share_size(len(shots), count)))]
        )


@contextmanager
def photographers(
    model: mujoco.MjModel, view: View, *, workers: int | None = None
) -> Iterator[Workers[Sequence[Shot], np.ndarray]]:
    """The processes of a `studio`: what is submitted is taken while the caller does other things."""
    count = process_count(workers, MOST_WORKERS)
    with workers_for(_work(model, view, count), workers=count) as crew:
        yield crew


def _work(model: mujoco.MjModel, view: View, processes: int | None) -> Work[Camera, Sequence[Shot], np.ndarray]:
    """Rendering by so many processes of this machine, or on a cluster (None)."""
    lens = {name: value for name, value in vars(view).items() if name != "shots"}
    set_up = partial(open_camera, lens, binary_model(model))
    threads = 1 if processes is None else max(1, core_count() // processes)
    return Work(set_up, take, _died, environment=renderer_environment(threads), keeps_messages=True)


def _died(shots: Sequence[Shot], how: str) -> RenderError:
    return RenderError(
        f"a renderer process {how} at {len(shots)} pictures. Run the command again, with fewer workers where memory is "
        "short"
    )


def process_count(workers: int | None, shots: int) -> int:
    """Number of processes for so many shots, 1 or more."""
    if workers is not None and workers < 1:
        raise RenderError(f"{workers} renderer processes cannot render; ask for 1 or more")
    return max(1, min(workers or core_count(), MOST_WORKERS, shots))


def _share_size(shots: int, processes: int) -> int:
    """Shots in a share, 1 or more; no process is left without one where there are enough."""
    return max(1, min(SHARE_SHOTS, -(-shots // processes)))


def _shares(shots: Sequence[Shot], size: int) -> Iterator[Sequence[Shot]]:
    return (shots[first : first + size] for first in range(0, len(shots), size))
