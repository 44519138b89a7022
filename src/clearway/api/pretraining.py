"""`pretrain`: eyes trained on views of many rooms."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from clearway.api.arguments import as_path, as_paths, as_whole, as_word, as_workers

if TYPE_CHECKING:
    from clearway.choices import TrackerName
    from clearway.pretraining.judge import Judgement

PathLike = str | os.PathLike[str]
MAX_PICTURES = 10**12
MAX_SEED = 2**31 - 1


def pretrain(
    views: Sequence[PathLike],
    *,
    out: PathLike,
    pictures: int = 2_000_000,
    seed: int = 0,
    keeping: str | None = None,
    try_on: Sequence[PathLike] = (),
    threads: int | None = None,
    workers: int = 1,
    ray: str | None = None,
    device: str = "cpu",
    resume: bool = False,
    track: TrackerName | None = None,
    show_progress: bool = False,
) -> Judgement | None:
    """Train eyes and leave them in a folder, whose name is then an encoder's.

    Args:
        views: files of views or folders of them, with colour and depth, two takes of each pose.
        out: the folder.
        pictures: to learn from in all; views that are seen again count again.
        seed: of the first parameters and of all chances.
        keeping: eyes, clearway or a folder, whose features stay as they are: only what is told from them is taught, for
            example on rooms like one's own. None: all is taught, from nothing.
        try_on: views of other rooms, to try the eyes on once they are trained.
        threads: of torch; None leaves its own choice. Results repeat bit for bit at one number. On a GPU so many
            threads make ready what it learns from.
        workers: processes that train together, each on its part of every batch; the eyes are those of
            one, up to rounding. A script that starts some keeps what it runs under `if __name__ == "__main__":`.
        ray: a Ray cluster that runs them: "local", "auto" or an address; None: this machine does.
        device: of torch, "cpu" or "cuda"; each worker has a GPU of its own.
        resume: go on from the newest checkpoint in `out`.
        track: where figures are shown as they come, "tensorboard" or "wandb", beside `metrics.jsonl`.
        show_progress: draw a progress bar, if standard error is a terminal.

    Returns:
        How well they see in the rooms of `try_on`; None where there are none.

    Raises:
        ArgumentError: an argument is out of range, or the views are of another kind.
        ClearwayError: views are missing or damaged, or `out` holds something else.
    """
    from clearway.perception.eyes import find_record, from_record, read_eyes
    from clearway.perception.eyes_network import EyesShape
    from clearway.pretraining.judge import judge
    from clearway.pretraining.pretrain import pretrain as train_eyes
    from clearway.pretraining.settings import PretrainSettings
    from clearway.pretraining.trainer import PretrainRequest, check_views
    from clearway.pretraining.workers import pretrain_by_workers
    from clearway.progress import work_progress
    from clearway.torch_threads import torch_threads
    from clearway.views.stream import views_in

    processes = as_workers(workers, ray)
    kept = None if keeping is None else from_record(find_record(keeping))
    shape = EyesShape() if kept is None else kept.eyes.shape
    settings = PretrainSettings(pictures=as_whole("pictures", pictures, 1, MAX_PICTURES), shape=shape)
    count = None if threads is None else as_whole("threads", threads, 1)
    tried = views_in(as_paths("try_on", try_on)) if try_on else None
    shown = views_in(as_paths("views", views))
    request = PretrainRequest(shown, settings, as_whole("seed", seed, 0, MAX_SEED), kept, as_word("device", device))
    if tried is not None:
        check_views("try_on", tried, shape)
    folder = as_path("out", out)
    if processes > 1:
        pretrain_by_workers(
            request, folder, processes, resume=resume, track=track, show_progress=show_progress, threads=count, ray=ray
        )
    with torch_threads(count):
        if processes == 1:
            with work_progress("learning to see", settings.pictures, show_progress) as show_done:
                train_eyes(request, folder, resume=resume, track=track, done=show_done)
        return None if tried is None else judge(read_eyes(folder), tried)
