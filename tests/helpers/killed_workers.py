"""A training by two workers, with a checkpoint after every update: `python -m helpers.killed_workers FOLDER`."""

from __future__ import annotations

import sys
from pathlib import Path

from clearway.learn.train import RunRequest
from clearway.learn.workers import train_by_workers
from helpers.small_runs import small_learner, small_request

UPDATES = 80
WORKERS = 2


def request() -> RunRequest:
    """What is trained."""
    return small_request(learner=small_learner(frames=80 * UPDATES))


if __name__ == "__main__":
    train_by_workers(request(), Path(sys.argv[1]), WORKERS, resume=True, threads=1, checkpoint_s=0.0)
