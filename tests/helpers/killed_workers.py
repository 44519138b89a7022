"""A training by two workers, with a checkpoint after every update: `python -m helpers.killed_workers FOLDER`.

Scene files may follow, whose features are mapped; without any, scenes are made in memory.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from clearway.learn.train import RunRequest
from clearway.learn.workers import train_by_workers
from clearway.scenes.thor_v1 import read_scene
from helpers.small_runs import small_learner, small_request

UPDATES = 80
MAPPED_UPDATES = 20
WORKERS = 2


def request(files: Sequence[Path] = ()) -> RunRequest:
    """What is trained."""
    if not files:
        return small_request(learner=small_learner(frames=80 * UPDATES))
    scenes = [read_scene(file, features_in_file=True) for file in files]
    return small_request(learner=small_learner(frames=80 * MAPPED_UPDATES), scenes=scenes, feature_store="mapped")


if __name__ == "__main__":
    out, *scenes = map(Path, sys.argv[1:])
    train_by_workers(request(scenes), out, WORKERS, resume=True, threads=1, checkpoint_s=0.0)
