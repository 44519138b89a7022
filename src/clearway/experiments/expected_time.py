"""How long a plan will take on this machine: each kind of learner is tried for some seconds, and so is its walk.

How far an agent will have learnt to walk by then nobody knows, so evaluation has two bounds: if all go straight, and if
all get lost.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from clearway.evaluation.episodes import run_episodes
from clearway.experiments.job import frames_left, request_of, trial_path
from clearway.experiments.plan import Job, LiveTrial, PlannedRun, SceneFile, TargetSets, Trial
from clearway.learn.foreign_agent import is_ours, made_agent
from clearway.learn.run_record import record_of
from clearway.learn.running import acting_tensors
from clearway.learn.train import RunRequest
from clearway.scenes.thor_v1 import read_scene
from clearway.torch_threads import torch_threads
from clearway.world.world import make_world

TRIED_S = 2.0
"""A kind of learner is tried for so long, after its first update."""
TRIED_STEPS = 20
"""All episodes of a kind's first trial are tried for so many steps."""


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
    """How long the missing trials take, behind what is said of training."""
    beside = min(workers, len(left))
    missing = [(job.run, trial) for job in left for trial in job.trials if not trial_path(out, job.run, trial).exists()]
    seconds_a_step: dict[object, float] = {}
    straight = lost = 0.0
    live = perturbed = others = 0
    for run, trial in missing:
        if isinstance(trial, LiveTrial):
            live += len(trial.settings) * sum(map(len, run.targets)) * trial.episodes_per_target
            continue
        ways = shortest_steps(run.scenes, trial.targets)
        episodes = len(ways) * trial.episodes_per_target
        if trial.perturbed is not None:  # pictures would have to be taken
            perturbed += episodes
            continue
        if not is_ours(run.learner):
            others += episodes  # what such an agent does untrained is not ours to try
            continue
        alike = replace(run, perturbed=None).kind, run.scenes  # it is tried on the scenes' own pictures
        if alike not in seconds_a_step:
            seconds_a_step[alike] = walking_time(run, trial, threads)
        straight += seconds_a_step[alike] * sum(ways) * trial.episodes_per_target
        lost += seconds_a_step[alike] * trial.step_limit * episodes
    told = ""
    if seconds_a_step:
        least, most = (_duration(seconds / beside) for seconds in (straight, lost))
        told = f"; evaluation {least} if all go straight, {most} if all get lost"
    further = (
        (live, "off the grid"),
        (perturbed, "on perturbed pictures"),
        (others, "of other packages' agents"),
    )
    return told + "".join(f"; {count:,} episodes {whose}" for count, whose in further if count)


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


def walking_time(run: PlannedRun, trial: Trial, threads: int) -> float:
    """Seconds a step of an episode, all side by side, tried for `TRIED_STEPS` by an agent that has learnt nothing."""
    request = request_of(replace(run, perturbed=None))
    with torch_threads(threads), closing(request.trainer()) as trainer:
        trained = made_agent(record_of(request), acting_tensors(trainer, trainer.tensors()), 1)
        targets = {scene.name: list(own) for scene, own in zip(request.scenes, trial.targets, strict=True)}
        world = make_world(request.scenes, targets)
        agent = trained.on_poses(world)
        began = time.perf_counter()
        table = run_episodes(
            world,
            agent,
            scenes=request.scenes,
            episodes_per_target=trial.episodes_per_target,
            step_limit=min(TRIED_STEPS, trial.step_limit),
        )
        return (time.perf_counter() - began) / int(table.steps.sum())


@cache
def shortest_steps(scenes: tuple[SceneFile, ...], targets: TargetSets) -> list[float]:
    """Mean steps of the shortest paths to each target from where episodes may begin."""
    found = []
    for file, own in zip(scenes, targets, strict=True):
        scene = read_scene(file.path, name=file.name)
        ways = scene.distances_to(np.array(own, dtype=np.int64))
        found += [float(way[way > 0].mean()) for way in ways]
    return found


def _duration(seconds: float) -> str:
    """To the minute, or to the second below two minutes."""
    if seconds < 120:
        return f"{max(1, round(seconds))} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"
