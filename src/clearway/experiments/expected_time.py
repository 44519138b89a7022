"""How long a plan will take on this machine: each kind of learner is tried for some seconds."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.experiments.expected_pictures import asked, time_of_pictures
from clearway.experiments.expected_walks import of_others, time_of_walks
from clearway.experiments.job import frames_left, request_of, trial_path
from clearway.experiments.plan import Job, PlannedRun
from clearway.learn.train import RunRequest
from clearway.torch_threads import torch_threads

TRIED_S = 2.0
"""A kind of learner is tried for so long, after its first update."""


def told_time(out: Path, jobs: Sequence[Job], left: Sequence[Job], workers: int | None, threads: int) -> str:
    """How many runs are to be trained, or only evaluated, how long training takes at least, and evaluation, in a line.

    Runs side by side are held for as fast as one alone; so many share memory and caches, and take longer.
    Where nobody knows how many there will be (`workers` None, on a Ray cluster), it is the time of all of them, one
    after the other.

    Args:
        out: folder of the reproduction: what has been trained there takes no time.
        jobs: all of the plan.
        left: those that are not done.
        workers: jobs side by side.
        threads: of each.
    """
    frames = [(job.run, frames_left(out, job.run)) for job in left]
    to_train = [(run, count) for run, count in frames if count]
    counted = f"{len(jobs)} runs, {len(to_train)} to be trained"
    if trained := len(left) - len(to_train):
        counted += f", {trained} only to be evaluated"
    walking = _told_walking(out, left, workers or 1, threads)
    if not to_train:
        return f"{counted}{walking}" if left else f"{counted}: all is there"
    speeds: dict[str, float] = {}
    seconds, longest = 0.0, 0.0
    for run, count in to_train:
        if run.kind not in speeds:
            speeds[run.kind] = frames_per_second(run, threads)
        seconds += count / speeds[run.kind]
        longest = max(longest, count / speeds[run.kind])
    beside = min(workers or 1, len(to_train))
    how, least = (f"{beside} at a time", " at least") if workers else ("one after the other", "")
    return f"{counted}, {how}: {_duration(max(longest, seconds / beside))} of training here{least}{walking}"


def _told_walking(out: Path, left: Sequence[Job], workers: int, threads: int) -> str:
    """How long the missing trials take, and the pictures that they and trainings see, behind what is said of training.

    Args:
        out: folder of the reproduction.
        left: jobs that are not done.
        workers: jobs side by side.
        threads: of each.
    """
    beside = min(workers, len(left))
    missing = [(job.run, trial) for job in left for trial in job.trials if not trial_path(out, job.run, trial).exists()]
    told = ""
    try:
        if (bounds := time_of_walks(missing, threads)) is not None:
            least, most = (_duration(seconds / beside) for seconds in (bounds.straight_s, bounds.lost_s))
            told = f"; evaluation {least} if all go straight, {most} if all get lost"
        if wanted := asked(out, left):
            taken = _duration(time_of_pictures(wanted, threads) / beside)
            told += f"; {sum(map(len, wanted)):,} perturbed pictures {taken}, less where they are kept"
    except ClearwayError as error:  # runs that need no pictures are made all the same, or others make them
        told += f"; not all can be tried here: {error}"
    return told + (f"; {others:,} episodes of other packages' agents" if (others := of_others(missing)) else "")


def frames_per_second(run: PlannedRun, threads: int) -> float:
    """Of a run's training, tried for `TRIED_S` seconds; nothing is kept of it."""
    with torch_threads(threads), closing(_request_without_pictures(run).trainer()) as trainer:
        trainer.update()
        frames, began = trainer.frames, time.perf_counter()
        while time.perf_counter() - began < TRIED_S and not trainer.finished:
            trainer.update()
        taken = time.perf_counter() - began
    return max(trainer.frames - frames, 1) / taken


def _request_without_pictures(run: PlannedRun) -> RunRequest:
    """What to train; for perturbed pictures, which are yet to be taken, stand as many of the scenes' own."""
    request = request_of(replace(run, perturbed=None))
    if run.perturbed is None:
        return request
    own = [np.asarray(scene.features) for scene in request.scenes]
    return replace(request, takes=[np.repeat(features[:, None], run.perturbed.takes, axis=1) for features in own])


def _duration(seconds: float) -> str:
    """To the minute, or to the second below two minutes."""
    if seconds < 120:
        return f"{max(1, round(seconds))} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"
