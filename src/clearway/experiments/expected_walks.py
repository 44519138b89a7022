"""How long a plan's trials will take on this machine: each kind's walk is tried for some steps.

How far an agent will have learnt to walk by then nobody knows, so there are two bounds: if all go straight, and if all
get lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from clearway.agents.by_pose import RandomWalk
from clearway.evaluation.episodes import run_episodes
from clearway.experiments.job import request_of
from clearway.experiments.plan import (
    RANDOM_WALK,
    LiveTrial,
    PlannedRun,
    SceneFile,
    TargetSets,
    Trial,
    targets_by_scene,
)
from clearway.learn.foreign_agent import is_ours, made_agent
from clearway.learn.load import TrainedAgent, TrainedNetwork
from clearway.learn.network_agent import NetworkAgent
from clearway.learn.run_record import record_of
from clearway.learn.running import acting_tensors
from clearway.learn.train import RunRequest
from clearway.live.episodes import LiveProtocol, run_live_episodes
from clearway.live.walks import stages
from clearway.scenes.thor_v1 import read_scene
from clearway.torch_threads import torch_threads
from clearway.world.world import make_world

Missing = tuple[PlannedRun, Trial | LiveTrial]
"""A trial that is not walked yet, with its run."""
TRIED_STEPS = 20
"""All episodes of a kind's first trial are tried for so many steps."""
TRIED_LIVE_STEPS = 4
"""An episode to each target of the first scene is tried for so many steps off the grid, after a first one."""


@dataclass(frozen=True)
class Bounds:
    """Seconds of walking, one episode after the other: if all agents go straight, and if all get lost."""

    straight_s: float
    lost_s: float


def of_others(missing: Iterable[Missing]) -> int:
    """Episodes of other packages' agents: what such agents do untrained is not ours to try."""
    return sum(
        trial.episodes * sum(map(len, trial.targets_of(run))) for run, trial in missing if not is_ours(run.learner)
    )


def time_of_walks(missing: Iterable[Missing], threads: int) -> Bounds | None:
    """What trials take, with so many threads; None where there are none of our own. Nothing is kept of what is tried.

    Raises:
        ClearwayError: pictures cannot be rendered here, or an encoder cannot be had, which a trial needs.
    """
    tried: dict[object, float] = {}
    straight_s = lost_s = 0.0
    for run, trial in missing:
        if not is_ours(run.learner):
            continue
        plain = replace(run, perturbed=None)  # who sees perturbed pictures walks as fast as by the scenes' own
        alike = plain.kind, run.scenes, type(trial), trial.walker == RANDOM_WALK
        if alike not in tried:
            tried[alike] = step_time(plain, trial, threads)
        ways = shortest_steps(run.scenes, trial.targets_of(run))
        straight_s += tried[alike] * trial.episodes * sum(ways)
        lost_s += tried[alike] * trial.episodes * len(ways) * trial.step_limit
    return Bounds(straight_s, lost_s) if tried else None


def step_time(run: PlannedRun, trial: Trial | LiveTrial, threads: int) -> float:
    """Seconds a step of an episode takes on the grid, or in the room itself."""
    if isinstance(trial, LiveTrial):
        return live_walking_time(run, trial, threads)
    return walking_time(run, trial, threads)


def walking_time(run: PlannedRun, trial: Trial, threads: int) -> float:
    """Seconds a step of an episode, all side by side, tried for `TRIED_STEPS` by an agent that has learnt nothing."""
    with torch_threads(threads), _untaught(run) as (request, trained):
        world = make_world(request.scenes, targets_by_scene(run.scenes, trial.targets))
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
        with stages(scenes, targets_by_scene(run.scenes[:1], run.targets[:1]), run.zone_level) as (place,):
            assert isinstance(trained, TrainedNetwork), run.learner  # of the named learners all have one
            agent = RandomWalk() if trial.walker == RANDOM_WALK else NetworkAgent(trained, 0, place.encoder)
            for steps in (1, min(TRIED_LIVE_STEPS, trial.step_limit)):  # the first renders, and encodes, slowly
                protocol = LiveProtocol(1, steps, trial.seed, "sampled")
                began = time.perf_counter()
                changed = trial.settings[-1].perturbations
                table = run_live_episodes(place.live, place.world, agent, place.camera, changed, protocol)
                taken = time.perf_counter() - began
    return taken / int(table.steps.sum())


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
