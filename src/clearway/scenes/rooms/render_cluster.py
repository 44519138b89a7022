"""Take all pictures of a room on a Ray cluster, share by share; every node that takes part must be able to render.

A share's task starts a renderer process of its own on its node, as `render` does here, so pictures are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import RenderError
from clearway.progress import picture_progress
from clearway.ray_cluster import connected, result
from clearway.scenes.rooms.render import render, take_alone
from clearway.scenes.rooms.render_worker import binary_model, job_head

if TYPE_CHECKING:
    import mujoco

    from clearway.scenes.rooms.camera import Shot, View

SHARE_SHOTS = 100  # pictures of a task, some ten seconds: starting a renderer takes one


def render_at(
    ray: str | None,
    model: mujoco.MjModel,
    view: View,
    *,
    workers: int | None = None,
    progress: bool = False,
    label: str = "rendering",
) -> np.ndarray:
    """The pictures of a view as `render` takes them, here or on a Ray cluster.

    Args:
        ray: None for this machine, else see `ray_cluster.connected`.
        model, view, progress, label: see `render`.
        workers: processes here; under "local" processors, None for all.

    Raises:
        RenderError: as of `render`; or a worker of the cluster died.
        RunError: Ray is not installed, or the cluster cannot be reached.
    """
    if ray is None:
        return render(model, view, workers=workers, progress=progress, label=label)
    pictures = view.empty_pictures(len(view.shots))
    with connected(ray, workers) as cluster, picture_progress(label, len(pictures), progress) as show_done:
        take = cluster.remote(num_cpus=1)(take_share)
        head = cluster.put(job_head(view, binary_model(model)))
        starts = range(0, len(pictures), SHARE_SHOTS)
        shares = [view.shots[first : first + SHARE_SHOTS] for first in starts]
        tasks = [take.remote(head, share, pictures.shape[1:], pictures.dtype) for share in shares]
        for first, share, task in zip(starts, shares, tasks, strict=True):
            pictures[first : first + len(share)] = result(cluster, task, _died)
            show_done(first + len(share))
    return pictures


def take_share(head: bytes, shots: Sequence[Shot], shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """Pictures (shots, *shape) by one renderer process of this machine; see `job_head`."""
    pictures = np.empty((len(shots), *shape), dtype)
    take_alone(head, pictures, shots)
    return pictures


def _died(reason: str) -> RenderError:
    return RenderError(f"a worker that renders, or its node, died ({reason}). Run the command again")
