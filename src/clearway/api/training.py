"""`train`."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args

import numpy as np

from clearway.agents.agent import FEATURES
from clearway.api.arguments import as_choice, as_path, as_seed, as_settings, as_truth, as_whole, as_word, as_workers
from clearway.api.perturbations import Perturbed, perturbations_asked
from clearway.api.run_settings import leave_settings, reward_options
from clearway.api.scenes import Scenes, by_name, scenes_and_files
from clearway.api.targets import Targets, chosen_targets, told_of_held_out
from clearway.choices import FeatureStore, TrackerName, ZoneLevel
from clearway.errors import ArgumentError
from clearway.learn.algorithms import ALGORITHMS, algorithm
from clearway.learn.learner import Learner
from clearway.learn.load import TrainedAgent, load_agent
from clearway.learn.plugged import faults_of
from clearway.learn.presets import PRESETS
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import RunRecord
from clearway.learn.solved import unsolved_targets
from clearway.learn.tracking import check_tracker
from clearway.learn.train import RunRequest, check_can_begin
from clearway.learn.train import train as train_alone
from clearway.learn.workers import train_by_workers
from clearway.live.conditions import Perturbations
from clearway.markdown import table_lines
from clearway.plugins import find_plugin, unknown
from clearway.reward import Reward, reward_named
from clearway.scenes.scene import Scene
from clearway.scenes.validate import SceneWarning
from clearway.torch_threads import torch_threads
from clearway.views.seen import TAKES, made_in_training, seed_in_training, takes_seen

FIGURES = ("frames", "seconds", "solved_targets", "success", "steps", "collisions")  # of the table of a training


@dataclass(frozen=True)
class TrainResult:
    """What came of a training.

    Attributes:
        agent: the trained agent.
        scenes: what it was trained on.
        metrics: rows of figures by name, some 200 over the training (`docs/metrics.md`).
        folder: the run folder; None where none was asked for.
        unsolved: targets that not all of their latest training episodes reached, state ids by scene name; empty where
            all are solved, or it cannot be told (see `clearway.learn.solved`).
    """

    agent: TrainedAgent
    scenes: tuple[Scene, ...]
    metrics: tuple[Mapping[str, float], ...]
    folder: Path | None = None
    unsolved: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    def __repr__(self) -> str:
        count = sum(map(len, self.record.targets.values()))
        where = "no folder" if self.folder is None else self.folder
        return f"<TrainResult: {self.agent.frames:,} frames, {self.solved_targets} of {count} targets solved, {where}>"

    @property
    def record(self) -> RunRecord:
        """All that determines the run, as its `run.json` holds it."""
        return self.agent.record

    @property
    def figures(self) -> Mapping[str, float]:
        """The last row of metrics; empty where a finished run has lost them."""
        return self.metrics[-1] if self.metrics else {}

    @property
    def solved_targets(self) -> int:
        """Targets that the agent reached in its latest training episodes."""
        return int(self.figures.get("solved_targets", 0))

    def markdown(self, rows: int = 10) -> str:
        """The main figures over the training as a table in Markdown, of so many evenly spaced rows at most."""
        chosen = _evenly(self.metrics, as_whole("rows", rows, 1))
        names = [name for name in FIGURES if name in self.figures]
        lines = table_lines(names, [[f"{row[name]:.6g}" if name in row else "" for name in names] for row in chosen])
        return "\n".join(lines) + "\n"


def train(
    scenes: Scenes,
    targets: Targets = None,
    *,
    reward: str | Reward = "collision-aware",
    algorithm: str | Learner = "ppo",
    frames: int | None = None,
    seed: int = 0,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    copy_to: str | None = None,
    zone_level: ZoneLevel = "pose",
    perturb: Perturbed = (),
    takes: int | None = None,
    device: str = "cpu",
    feature_store: FeatureStore = "memory",
    threads: int | None = None,
    workers: int = 1,
    ray: str | None = None,
    until_solved: bool = False,
    track: TrackerName | None = None,
    on_begin: Callable[[Path], None] | None = None,
    show_progress: bool = False,
    **settings: Any,
) -> TrainResult:
    """Train an agent, as `clearway train` does, and give it back.

    Args:
        scenes: a scene, a scene file, a folder of them, or several. All with features of one encoder.
        targets: state ids by scene name, or state ids alone for a single scene; five seeded ones where there are none,
            in generated rooms and flats none that is held out. "held-out": such ones alone.
        reward: one of `clearway.reward.REWARDS` by its name, a `Reward`, or package.module:name.
        algorithm: "ppo" (our recipe), "a2c", "a3c" (as published), "bc", "q-learning", "recurrent" or "adapt" (adapts
            the generalist to the scenes, which have features of its eyes), with its own
            defaults; a preset, such as "paper" (the published settings, synchronous); or settings, such as
            `PPO(envs=200)`.
        frames: training frames, instead of the algorithm's own.
        seed: of parameters, environments, actions and the choice of targets.
        out: the run folder, which `clearway evaluate`, `view`, `export` and the others open. None keeps no folder: the
            run lies in a temporary one until `train` returns, and what there is of it is what `train` returns. Give
            scene files, not scenes in memory, where the folder is to be opened without naming them again.
        resume: go on with the run in `out` from its newest checkpoint; with more `frames`, with a finished one too.
        copy_to: address in an object store, such as s3://bucket/run, to which the run is copied after each checkpoint.
            With `resume`, where `out` holds no run, it is fetched from there first.
        zone_level: whether zones are those of poses ("pose") or of whole cells ("cell").
        perturb: what is perturbed in pictures of every pose that are seen beside the scene's own, one a step, as of
            `evaluate_goals`; nothing by default. The scenes are rooms that can be built again; by
            ppo, a2c and recurrent.
        takes: pictures of each pose where they are perturbed; None: 4.
        device: of torch, "cpu" or "cuda".
        feature_store: where features are kept: "memory", "float16" or "mapped", see `clearway.world.feature_store`.
        threads: of torch meanwhile, or processes of a3c; results repeat bit for bit at one number of them.
        workers: processes of this machine that train together, a scene each at least; by ppo, a2c and bc. A script that
            asks for several, or for a3c, does it below `if __name__ == "__main__":`. See docs/scale.md.
        ray: a Ray cluster whose nodes run the workers: "local", "auto" or an address. All see scene files and `out`
            under the same paths.
        until_solved: stop before all frames are used, once the latest 20 training episodes or more of every target
            reached it.
        track: where figures are shown as they come, beside `metrics.jsonl`: "tensorboard", in the run folder, or
            "wandb", offline unless its user has logged in.
        on_begin: called with the run folder as soon as it holds the run, before the first frame.
        show_progress: draw a progress bar; where there is no terminal, print a line now and then.
        settings: single settings of the algorithm by name, such as `envs=200`; all are fields of its class.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: the settings cannot work together, or the scenes, targets or folder cannot be used.
        KeyboardInterrupt: the user interrupted; a run with a folder can be resumed.
    """
    store = as_choice("feature_store", feature_store, get_args(FeatureStore))
    if (resume or copy_to is not None) and out is None:
        asked = "resume=True" if resume else f"copy_to={copy_to!r:.80}"
        raise ArgumentError(f"{asked}: expected the run folder to go on with, or to copy. Give it as out")
    processes = as_workers(workers, ray)
    number = as_seed("seed", seed)
    learner = chosen_learner(algorithm, frames, settings)
    pairs = scenes_and_files(scenes, features_in_file=store != "memory" or processes > 1)
    loaded = [scene for scene, _ in pairs]
    chosen = chosen_targets(loaded, targets, number)
    for line in told_of_held_out(loaded, chosen):
        warnings.warn(line, SceneWarning, stacklevel=2)
    with faults_of(learner, "warn_of"):
        learner.warn_of(loaded)
    earned, word = reward_named(reward), as_word("device", device)  # before what takes long
    level = as_choice("zone_level", zone_level, get_args(ZoneLevel))
    thread_count = None if threads is None else as_whole("threads", threads, 1)
    until_solved = as_truth("until_solved", until_solved)
    copied = None if copy_to is None else as_word("copy_to", copy_to)
    kept = None if out is None else as_path("out", out)
    request = RunRequest(
        scenes=loaded,
        targets=chosen,
        learner=learner,
        reward=earned,
        seed=number,
        zone_level=level,  # type: ignore[arg-type]
        paths=by_name(pairs),
        device=word,
        feature_store=store,  # type: ignore[arg-type]
    )
    perturbations = perturbations_asked(perturb)
    if (count := _takes_asked(perturbations, takes)) is not None:  # none yet, to be refused before they are taken
        request = replace(request, takes=(), takes_made=made_in_training(perturbations, count, number))
    _check(request, kept, workers=processes, ray=ray, resume=resume, track=track, copy_to=copied)
    if count is not None:
        request = replace(request, takes=_takes(request, perturbations, count, show_progress))

    def begun(path: Path) -> None:
        leave_settings(
            path,
            reward_options(reward),
            perturb=_as_words(perturb),
            takes=count,
            threads=thread_count,
            workers=processes if processes > 1 else None,
            until="solved" if until_solved else None,
            track=track,
        )
        if on_begin is not None:
            on_begin(path)

    with ExitStack() as stack:
        stack.enter_context(torch_threads(thread_count))
        path = stack.enter_context(_temporary()) if kept is None else kept
        together = partial(train_by_workers, workers=processes, threads=thread_count, ray=ray)
        train_run = train_alone if processes == 1 else together
        folder = train_run(
            request,
            path,
            resume=resume,
            show_progress=show_progress,
            until_solved=until_solved,
            track=track,
            on_begin=begun,
            copy_to=copied,
        )
        return TrainResult(
            agent=load_agent(path),
            scenes=tuple(loaded),
            metrics=tuple(folder.metrics()),
            folder=kept,
            unsolved=unsolved_targets(folder),
        )


def chosen_learner(
    wanted: str | Learner, frames: int | None = None, settings: Mapping[str, object] = MappingProxyType({})
) -> Learner:
    """The settings of an algorithm, some of them changed.

    Args:
        wanted: the algorithm's name, a preset's, or settings.
        frames: training frames; None: the algorithm's own.
        settings: others by name.

    Raises:
        ArgumentError: there is no such algorithm or setting, or a value is of the wrong type.
        RunError: the settings cannot work together.
    """
    if isinstance(wanted, Learner):
        learner = wanted
        if not _is_known(learner):
            problem = f"algorithm={type(learner).__name__}: its runs could not be read again"
            raise ArgumentError(f"{problem}. Offer the class by an entry point (clearway.plugins), or use one of ours")
    elif isinstance(wanted, str) and wanted in PRESETS:
        learner = PRESETS[wanted]
    elif isinstance(wanted, str) and (wanted in ALGORITHMS or find_plugin("algorithms", wanted)):
        learner = algorithm(wanted)()
    else:
        told = unknown("algorithms", wanted, (*ALGORITHMS, *PRESETS))
        raise ArgumentError(f"algorithm={wanted!r:.80}: {told}")
    given = settings if frames is None else {**settings, "frames": frames}
    changes = as_settings(type(learner), given)
    with faults_of(learner, "settings"):
        return replace(learner, **changes)


def _check(
    request: RunRequest,
    folder: Path | None,
    *,
    workers: int,
    ray: str | None,
    resume: bool,
    track: TrackerName | None,
    copy_to: str | None,
) -> None:
    """Refuse, before pictures are taken, most of what training would refuse after it. Raises ClearwayError."""
    check_tracker(track)
    request.check(workers, ray)
    if folder is None:
        return
    if request.takes is not None:
        check_can_begin(request, folder, resume=resume, copy_to=copy_to)
    elif not resume:
        RunFolder(folder).check_free()


def _takes_asked(perturbations: Perturbations, takes: int | None) -> int | None:
    """How many perturbed takes of each pose are seen; None where nothing is perturbed."""
    if perturbations != Perturbations():
        return TAKES if takes is None else as_whole("takes", takes, 1)
    if takes is not None:
        raise ArgumentError(f"takes={takes}: where nothing is perturbed a pose has one picture. Give perturb, too")
    return None


def _takes(request: RunRequest, perturbations: Perturbations, count: int, show_progress: bool) -> Sequence[np.ndarray]:
    """Features of so many perturbed takes of the scenes' poses, see `RunRequest.takes`."""
    own = seed_in_training(request.seed)
    sees = (FEATURES,)
    taken = takes_seen(request.scenes, perturbations, sees, None, takes=count, seed=own, show_progress=show_progress)
    return taken.seen[FEATURES]


def _as_words(perturb: Perturbed) -> tuple[str, ...]:
    """What is perturbed, as words of the command line."""
    if isinstance(perturb, Perturbations):
        return tuple(f"{name}={float(value)!r}" for name, value in perturb.to_json().items() if value)
    return tuple(perturb.split() if isinstance(perturb, str) else perturb)


def _is_known(learner: Learner) -> bool:
    """The class is the one that a run's record would be read with."""
    name = learner.algorithm
    return (name in ALGORITHMS or find_plugin("algorithms", name) is not None) and algorithm(name) is type(learner)


@contextmanager
def _temporary() -> Iterator[Path]:
    """A folder that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="clearway-") as folder:
        yield Path(folder) / "run"


def _evenly(rows: Sequence[Mapping[str, float]], count: int) -> list[Mapping[str, float]]:
    """So many of the rows at most, evenly spaced, with the last."""
    count = min(count, len(rows))
    return [rows[(number + 1) * len(rows) // count - 1] for number in range(count)]
