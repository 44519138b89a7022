"""How many perturbed pictures a plan's trainings and trials see, and how long they take on this machine."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from clearway.experiments.job import frames_left, request_of, trial_path
from clearway.experiments.plan import Job, PerturbedPictures, PlannedRun, SceneFile, Trial, targets_by_scene
from clearway.live.draws import Draws
from clearway.live.episodes import Walking
from clearway.live.walks import stages
from clearway.perception.encode import features_of
from clearway.scenes.thor_v1 import read_scene
from clearway.torch_threads import torch_threads
from clearway.views.seen import seed_in_training

TRIED_PICTURES = 16
"""So many are tried, after a first one."""


@dataclass(frozen=True)
class Asked:
    """Perturbed pictures of all poses of some scenes, by a seed."""

    scenes: tuple[SceneFile, ...]
    pictures: PerturbedPictures
    seed: int

    def __len__(self) -> int:
        """How many they are."""
        return self.pictures.takes * poses(self.scenes)


def asked(out: Path, left: Sequence[Job]) -> dict[Asked, PlannedRun]:
    """What some jobs that are not done see, with a run for which it is taken; those kept from before, too."""
    found: dict[Asked, PlannedRun] = {}
    for job in left:
        run = job.run
        if run.perturbed is not None and frames_left(out, run):
            found.setdefault(Asked(run.scenes, run.perturbed, seed_in_training(run.seed)), run)
        for trial in job.trials:
            if isinstance(trial, Trial) and trial.perturbed and not trial_path(out, run, trial).exists():
                found.setdefault(Asked(run.scenes, trial.perturbed, trial.seed), run)
    return found


def time_of_pictures(wanted: dict[Asked, PlannedRun], threads: int) -> float:
    """Seconds to take and encode all of them, one after the other.

    Raises:
        ClearwayError: no pictures can be rendered here, or an encoder cannot be had.
    """
    tried: dict[tuple[SceneFile, ...], float] = {}
    seconds = 0.0
    for one, run in wanted.items():
        if one.scenes not in tried:
            tried[one.scenes] = picture_time(run, one.pictures, threads)
        seconds += len(one) * tried[one.scenes]
    return seconds


def picture_time(run: PlannedRun, pictures: PerturbedPictures, threads: int) -> float:
    """Seconds to take a perturbed picture of the run's first scene and to encode it, tried on `TRIED_PICTURES`.

    Raises:
        ClearwayError: as of `time_of_pictures`.
    """
    scenes, targets = request_of(replace(run, perturbed=None)).scenes[:1], run.targets[:1]
    own = targets_by_scene(run.scenes[:1], targets)
    states = np.resize(np.delete(np.arange(scenes[0].state_count), targets[0][0]), TRIED_PICTURES + 1)
    with torch_threads(threads), stages(scenes, own, run.zone_level) as (place,):
        first, *others = (
            Walking(place.live, int(state), targets[0][0], Draws(seed, pictures.perturbations))
            for seed, state in enumerate(states)
        )
        for walkers in ([first], others):  # the first renders, and encodes, slowly
            began = time.perf_counter()
            features_of(place.camera([walker.shot() for walker in walkers]), place.encoder)
            taken = time.perf_counter() - began
    return taken / len(others)


@cache
def poses(scenes: tuple[SceneFile, ...]) -> int:
    """Of all scenes together."""
    return sum(read_scene(file.path, name=file.name).state_count for file in scenes)
