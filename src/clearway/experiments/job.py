"""One job done: train what is missing, walk the trials that are missing. The same code on every machine.

A job's folder is a run folder with a folder `trials` beside the checkpoints. Whatever is complete there is left as it
is, so a job that was interrupted goes on from its last checkpoint.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from clearway.agents.agent import FEATURES
from clearway.errors import RunError
from clearway.evaluation.episode_files import read_episodes
from clearway.evaluation.episodes import EpisodeTable
from clearway.experiments.grid_trial import walk_on_grid
from clearway.experiments.live_trial import walk_live
from clearway.experiments.plan import Job, LiveTrial, PlannedRun, Trial, targets_by_scene
from clearway.learn.checkpoint import checkpoints, frames_in
from clearway.learn.run_folder import RunFolder
from clearway.learn.train import RunRequest, set_threads, train
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene
from clearway.views.seen import made_in_training, seed_in_training, takes_seen

RUNS, TRIALS = "runs", "trials"


def run_folder(out: Path, run: PlannedRun) -> RunFolder:
    """Where a run's files are, under the folder of a reproduction."""
    return RunFolder(out / RUNS / run.name)


def trial_path(out: Path, run: PlannedRun, trial: Trial | LiveTrial) -> Path:
    """Where a trial's episodes are."""
    return run_folder(out, run).path / TRIALS / f"{trial.name}.json"


def frames_left(out: Path, run: PlannedRun) -> int:
    """How many frames a run's training has before it, by the name of its newest checkpoint."""
    there = checkpoints(run_folder(out, run).checkpoints)
    return max(0, run.learner.frames - (frames_in(there[-1].name) if there else 0))


def is_done(out: Path, job: Job) -> bool:
    """All of the job's trials have been walked; where it has none, its run has been trained."""
    if not job.trials:
        return not frames_left(out, job.run)
    return all(trial_path(out, job.run, trial).exists() for trial in job.trials)


def any_walked(out: Path, jobs: Iterable[Job]) -> bool:
    """Some trial of the jobs has been walked."""
    return any(trial_path(out, job.run, trial).exists() for job in jobs for trial in job.trials)


def unfinished(out: Path, jobs: Iterable[Job]) -> tuple[str, ...]:
    """Names of the runs whose jobs are not done."""
    return tuple(dict.fromkeys(job.run.name for job in jobs if not is_done(out, job)))


def do(out: Path, job: Job, threads: int) -> None:
    """Train the run, or what is left of it, and walk its missing trials; of a run that begins anew, all.

    Raises:
        ClearwayError: a scene is missing or has changed, or the code of the reward's terms; or training failed.
    """
    set_threads(threads)
    run, scenes = job.run, _scenes(job.run)
    if replace(run).name != run.name:  # as this process has it; the name has come along
        problem = f"run {run.name}: the code of its reward's terms has changed since it was planned"
        raise RunError(f"{problem}. Run the command again")
    folder = run_folder(out, run)
    if folder.trained_frames() < run.learner.frames:
        _train(folder, run, scenes)
    for trial in job.trials:
        path = trial_path(out, run, trial)
        if path.exists():
            continue
        if isinstance(trial, LiveTrial):
            walk_live(path, folder.path, scenes, run, trial)
        else:
            walk_on_grid(path, folder, scenes, run, trial)


def _train(folder: RunFolder, run: PlannedRun, scenes: Sequence[Scene]) -> None:
    """Train the run, or what is left of it; what an agent did that is no more, as of a record, goes."""

    def begun(path: Path) -> None:
        if (path / TRIALS).exists():
            shutil.rmtree(path / TRIALS)

    train(request_of(run, scenes), folder.path, resume=True, milestones=(run.halfway,), on_begin=begun)


def request_of(run: PlannedRun, scenes: Sequence[Scene] | None = None) -> RunRequest:
    """What to train; perturbed pictures are taken where they are not kept.

    Args:
        run: to be trained.
        scenes: of the run; None: they are read from their files.

    Raises:
        ClearwayError: a scene is missing or has changed, or perturbed pictures cannot be taken.
    """
    request = RunRequest(
        scenes=_scenes(run) if scenes is None else scenes,
        targets=targets_by_scene(run.scenes, run.targets),
        learner=run.learner,
        reward=run.reward,
        seed=run.seed,
        zone_level=run.zone_level,
        paths={scene.name: scene.path for scene in run.scenes},
    )
    if (asked := run.perturbed) is None:
        return request
    own = seed_in_training(run.seed)
    taken = takes_seen(request.scenes, asked.perturbations, (FEATURES,), None, takes=asked.takes, seed=own, workers=1)
    made = made_in_training(asked.perturbations, asked.takes, run.seed)
    return replace(request, takes=taken.seen[FEATURES], takes_made=made)


def episodes_of(out: Path, run: PlannedRun, trial: Trial) -> EpisodeTable | None:
    """A trial's episodes; None where they have not been walked yet."""
    path = trial_path(out, run, trial)
    return read_episodes(path)[0] if path.exists() else None


def _scenes(run: PlannedRun) -> list[Scene]:
    scenes = []
    for wanted in run.scenes:
        scene = read_scene(wanted.path, name=wanted.name)
        if scene_digest(scene) != wanted.digest:
            raise RunError(f"{wanted.path}: has changed since the plan was made. Start again with another --out")
        scenes.append(scene)
    return scenes
