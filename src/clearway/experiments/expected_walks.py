"""How long a plan's trials will take on this machine: each kind's walk is tried for some steps, a picture some times.

How far an agent will have learnt to walk by then nobody knows, so there are two bounds: if all go straight, and if all
get lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from clearway.agents.by_pose import RandomWalk
from clearway.evaluation.episodes import run_episodes
from clearway.experiments.job import frames_left, request_of, trial_path
from clearway.experiments.plan import (
    RANDOM_WALK,
    Job,
    LiveTrial,
    PerturbedPictures,
    PlannedRun,
    SceneFile,
    TargetSets,
    Trial,
    by_name,
)
from clearway.learn.foreign_agent import is_ours, made_agent
from clearway.learn.load import TrainedAgent, TrainedNetwork
from clearway.learn.network_agent import NetworkAgent
from clearway.learn.run_record import record_of
from clearway.learn.running import acting_tensors
from clearway.learn.train import RunRequest
from clearway.live.draws import Draws
from clearway.live.episodes import LiveProtocol, Walking, run_live_episodes
from clearway.live.walks import stages
from clearway.perception.encode import features_of
from clearway.scenes.thor_v1 import read_scene
from clearway.torch_threads import torch_threads
from clearway.views.seen import seed_in_training
from clearway.world.world import make_world

TRIED_STEPS = 20
"""All episodes of a kind's first trial are tried for so many steps."""
TRIED_LIVE_STEPS = 4
"""An episode to each target of the first scene is tried for so many steps off the grid, after a first one."""
TRIED_PICTURES = 16
"""So many perturbed pictures are tried, after a first one."""

Asked = tuple[tuple[SceneFile, ...], PerturbedPictures, int]
"""Perturbed pictures of all poses of some scenes, by a seed."""


@dataclass(frozen=True)
class ExpectedWalks:
    """What trials take, one after the other.

    Attributes:
        straight_s, lost_s: seconds of walking if all agents go straight, and if all get lost; None: nothing is tried.
        pictures, pictures_s: how many perturbed pictures trainings and trials see, and seconds to take all of them.
        others: episodes of other packages' agents, which are not tried.
    """

    straight_s: float | None
    lost_s: float | None
    pictures: int
    pictures_s: float
    others: int


def expected_walks(out: Path, left: Sequence[Job], threads: int) -> ExpectedWalks:
    """What the missing trials of some jobs take, with so many threads; nothing is kept of what is tried.

    Raises:
        ClearwayError: no pictures can be rendered here, or an encoder cannot be had, which trials need.
    """
    missing = [(job.run, trial) for job in left for trial in job.trials if not trial_path(out, job.run, trial).exists()]
    tried: dict[object, float] = {}
    straight_s = lost_s = 0.0
    others = 0
    for run, trial in missing:
        ways, settings = shortest_steps(run.scenes, _targets(run, trial)), 1
        if isinstance(trial, LiveTrial):
            settings = len(trial.settings)
        each = trial.episodes_per_target * settings
        if not is_ours(run.learner):
            others += len(ways) * each  # what such an agent does untrained is not ours to try
            continue
        plain = replace(run, perturbed=None)  # who sees perturbed pictures walks as fast as by the scenes' own
        alike = plain.kind, run.scenes, isinstance(trial, LiveTrial), trial.walker == RANDOM_WALK
        if alike not in tried:
            tried[alike] = (
                live_walking_time(plain, trial, threads)
                if isinstance(trial, LiveTrial)
                else walking_time(plain, trial, threads)
            )
        straight_s += tried[alike] * sum(ways) * each
        lost_s += tried[alike] * trial.step_limit * len(ways) * each
    pictures, pictures_s = _pictures(out, left, missing, threads)
    if not tried:
        return ExpectedWalks(None, None, pictures, pictures_s, others)
    return ExpectedWalks(straight_s, lost_s, pictures, pictures_s, others)


def _targets(run: PlannedRun, trial: Trial | LiveTrial) -> TargetSets:
    return run.targets if isinstance(trial, LiveTrial) else trial.targets


def _pictures(
    out: Path, left: Sequence[Job], missing: Sequence[tuple[PlannedRun, Trial | LiveTrial]], threads: int
) -> tuple[int, float]:
    """How many perturbed pictures are seen, and seconds to take and encode them; those kept from before, too."""
    asked: dict[Asked, PlannedRun] = {}
    for job in left:
        if job.run.perturbed is not None and frames_left(out, job.run):
            asked.setdefault((job.run.scenes, job.run.perturbed, seed_in_training(job.run.seed)), job.run)
    for run, trial in missing:
        if isinstance(trial, Trial) and trial.perturbed is not None:
            asked.setdefault((run.scenes, trial.perturbed, trial.seed), run)
    tried: dict[tuple[SceneFile, ...], float] = {}
    count, seconds = 0, 0.0
    for (scenes, pictures, _), run in asked.items():
        if scenes not in tried:
            tried[scenes] = picture_time(run, pictures, threads)
        own = pictures.takes * poses(scenes)
        count, seconds = count + own, seconds + own * tried[scenes]
    return count, seconds


def walking_time(run: PlannedRun, trial: Trial, threads: int) -> float:
    """Seconds a step of an episode, all side by side, tried for `TRIED_STEPS` by an agent that has learnt nothing."""
    with torch_threads(threads), _untaught(run) as (request, trained):
        world = make_world(request.scenes, by_name(run.scenes, trial.targets))
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


def live_walking_time(run: PlannedRun, trial: LiveTrial, threads: int) -> float:
    """Seconds a step of an episode in the room itself, as `walking_time`; in the first scene, under the last setting.

    Raises:
        ClearwayError: no pictures can be rendered here, or the scene's encoder cannot be had.
    """
    with torch_threads(threads), _untaught(run) as (request, trained):
        scenes = request.scenes[:1]
        with stages(scenes, by_name(run.scenes[:1], run.targets[:1]), run.zone_level) as (place,):
            assert isinstance(trained, TrainedNetwork), run.learner  # of the named learners all have one
            agent = RandomWalk() if trial.walker == RANDOM_WALK else NetworkAgent(trained, 0, place.encoder)
            for steps in (1, min(TRIED_LIVE_STEPS, trial.step_limit)):  # the first renders, and encodes, slowly
                protocol = LiveProtocol(1, steps, trial.seed, "sampled")
                began = time.perf_counter()
                changed = trial.settings[-1].perturbations
                table = run_live_episodes(place.live, place.world, agent, place.camera, changed, protocol)
                taken = time.perf_counter() - began
    return taken / int(table.steps.sum())


def picture_time(run: PlannedRun, pictures: PerturbedPictures, threads: int) -> float:
    """Seconds to take a perturbed picture of the run's first scene and to encode it, tried on `TRIED_PICTURES`.

    Raises:
        ClearwayError: as of `live_walking_time`.
    """
    scenes = request_of(replace(run, perturbed=None)).scenes[:1]
    target = run.targets[0][0]
    with torch_threads(threads), stages(scenes, by_name(run.scenes[:1], run.targets[:1]), run.zone_level) as (place,):
        states = np.resize(np.delete(np.arange(scenes[0].state_count), target), TRIED_PICTURES + 1)
        first, *others = (
            Walking(place.live, int(state), target, Draws(seed, pictures.perturbations))
            for seed, state in enumerate(states)
        )
        for walkers in ([first], others):
            began = time.perf_counter()
            features_of(place.camera([walker.shot() for walker in walkers]), place.encoder)
            taken = time.perf_counter() - began
    return taken / len(others)


@contextmanager
def _untaught(run: PlannedRun) -> Iterator[tuple[RunRequest, TrainedAgent]]:
    """What would be trained, and its agent that has learnt nothing, for the block."""
    request = request_of(run)
    with closing(request.trainer()) as trainer:
        trained = made_agent(record_of(request), acting_tensors(trainer, trainer.tensors()), 1)
        yield request, trained


@cache
def shortest_steps(scenes: tuple[SceneFile, ...], targets: TargetSets) -> list[float]:
    """Mean steps of the shortest paths to each target from where episodes may begin."""
    found = []
    for file, own in zip(scenes, targets, strict=True):
        scene = read_scene(file.path, name=file.name)
        ways = scene.distances_to(np.array(own, dtype=np.int64))
        found += [float(way[way > 0].mean()) for way in ways]
    return found


@cache
def poses(scenes: tuple[SceneFile, ...]) -> int:
    """Of all scenes together."""
    return sum(read_scene(file.path, name=file.name).state_count for file in scenes)
