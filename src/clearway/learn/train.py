"""A training run from start (or checkpoint) to end: files, progress, interruption."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from clearway.children import children_import_program
from clearway.choices import FeatureStore, TrackerName, ZoneLevel
from clearway.errors import RunError
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress, read_training
from clearway.learn.foreign import ForeignTrainer, made_trainer
from clearway.learn.interruption import interruption
from clearway.learn.learner import Learner
from clearway.learn.peers import ALONE, Peers
from clearway.learn.plugged import faults_of, paid_by
from clearway.learn.progress import progress_view
from clearway.learn.run_copy import RunCopy
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.running import Learning, Running
from clearway.learn.seeds import check_seed
from clearway.learn.share import Share, check_scenes
from clearway.learn.tracking import check_tracker
from clearway.reward import Reward
from clearway.scenes.features import FileFeatures
from clearway.scenes.parts import check_name
from clearway.scenes.scene import Scene
from clearway.torch_device import usable_device
from clearway.world.mapped_scenes import mapped_scenes
from clearway.world.world import World, make_world

SECONDS_BETWEEN_CHECKPOINTS = 60.0


@dataclass(frozen=True)
class RunRequest:
    """What to train, on what, where.

    Attributes:
        scenes: with features, distinct names.
        targets: state ids by scene name.
        learner, reward, seed, zone_level: see there.
        paths: file of each scene by name, where it has one.
        device: torch device, for example "cpu" or "cuda".
        feature_store: where features are kept, see `clearway.world.feature_store`.
        takes: features of other pictures of each scene's poses, (S, K, F) float32; at every step one of them or of the
            scene's own is seen, targets in the scene's own.
        takes_made: how they were made, JSON values.
        digests: of the scenes (`scene_digest`), where they are known.

    Raises:
        RunError: the seed is out of range, or the algorithm learns from no takes.
        RewardError: a run's record cannot hold the reward.
        SceneError: a scene's name cannot be part of a file's.
    """

    scenes: Sequence[Scene]
    targets: Mapping[str, Sequence[int]]
    learner: Learner
    reward: Reward
    seed: int = 0
    zone_level: ZoneLevel = "pose"
    paths: Mapping[str, Path] | None = None
    device: str = "cpu"
    feature_store: FeatureStore = "memory"
    takes: Sequence[np.ndarray] | None = None
    takes_made: Mapping[str, Any] | None = None
    digests: Sequence[str] | None = None

    def __post_init__(self) -> None:
        check_seed(self.seed)
        self.reward.to_json()
        for scene in self.scenes:
            check_name(scene.name, "scenes")
        if self.takes is not None:
            with faults_of(self.learner, "check_sees_takes"):
                self.learner.check_sees_takes()
            if self.feature_store == "mapped":
                raise RunError("perturb: features of perturbed pictures are kept in memory. Leave feature_store out")

    @property
    def paid(self) -> Reward:
        """The reward as training pays it, see `paid_by`."""
        return paid_by(self.learner, self.reward)

    def check(self, workers: int, ray: str | None = None) -> None:
        """Refuse what so many workers, here or on a Ray cluster, cannot train, before anything that takes long.

        Raises:
            RunError: the learner, its settings or the scenes are not for so many workers, or there is no such device.
            RewardError: workers cannot import a term of the reward.
            ClearwayError: the learner cannot be paid so.
        """
        usable_device(self.device)
        _ = self.paid
        if workers == 1:
            return
        self.reward.check_sent(main_too=ray is None and children_import_program())
        states = [scene.state_count for scene in self.scenes]
        check_scenes(len(states), workers)
        with faults_of(self.learner, "check_workers"):
            self.learner.check_workers(torch.tensor(states))

    def trainer(self, peers: Peers = ALONE) -> Learning:
        """A trainer at its first frame; of several workers, that of this one, with its part of the scenes.

        Raises:
            RunError: the learner, its settings or the scenes are not for so many workers.
            PluginError: the algorithm is another package's, and gives no trainer.
        """
        device, reward = usable_device(self.device), self.paid  # before the scenes, which may take long
        if peers.count == 1:
            return made_trainer(self.learner, self._world(slice(None)).to(device), reward, self.seed)
        sizes = [scene.state_count for scene in self.scenes], [len(self.targets[scene.name]) for scene in self.scenes]
        share = Share.of(*sizes, peers)
        return made_trainer(self.learner, self._world(share.own).to(device), reward, self.seed, share)

    def _world(self, part: slice) -> World:
        """The tables of a part of the scenes."""
        scenes = self.scenes[part]
        whole = len(scenes) == len(self.scenes)
        targets = self.targets if whole else {scene.name: self.targets[scene.name] for scene in scenes}
        world = make_world(scenes, targets, self.zone_level, self.feature_store)
        return world if self.takes is None else world.with_takes(self.takes[part])


def train(
    request: RunRequest,
    out: Path,
    *,
    resume: bool = False,
    show_progress: bool = False,
    milestones: Sequence[int] = (),
    until_solved: bool = False,
    track: TrackerName | None = None,
    on_begin: Callable[[Path], None] | None = None,
    copy_to: str | None = None,
) -> RunFolder:
    """Train until all frames are used and leave a run folder behind.

    Args:
        request: what to train.
        out: the run folder.
        resume: go on from the newest checkpoint in `out`; without one, or without a run, begin. A finished run goes on
            where more frames are asked for.
        show_progress: draw a progress bar.
        milestones: keep the agent as it is after so many frames too, see `RunFolder.milestone`.
        until_solved: stop before that, once every target is solved, see `EpisodeStatistics.solved`.
        track: where figures are shown as they come, see `tracking`.
        on_begin: called with the run folder as soon as it holds the run, before the first frame.
        copy_to: address in an object store to which the run is copied after each checkpoint; with `resume`, and where
            `out` holds no run, it is fetched from there first.

    Raises:
        RunError: `out` holds a run already (and resume is off) or another experiment, is in use, or training failed.
        PluginError: the algorithm is another package's, and fails.
        KeyboardInterrupt: the user interrupted; the run can be resumed.
    """
    check_tracker(track)
    folder = RunFolder(out)
    with ExitStack() as stack:
        with features_read_once(request) as read:
            trainer = stack.enter_context(closing(read.trainer()))  # what cannot be trained leaves no folder
            record = record_of(read)
            if isinstance(trainer, ForeignTrainer):
                trainer.try_agent(record, trainer.tensors())  # nor what could not act after all its frames
            copy = opened_copy(copy_to, folder, resume)
        stack.enter_context(folder.held())
        other_bits = stack.enter_context(folder.begun(record, resume))
        if on_begin is not None:
            on_begin(out)
        told_of_other_bits(folder, request, other_bits)
        seconds = 0.0 if other_bits is None else _resumed(trainer, folder)
        view = stack.enter_context(progress_view(trainer.learner.frames, show_progress))
        interrupted = stack.enter_context(interruption())
        every_s = SECONDS_BETWEEN_CHECKPOINTS
        run = Running(trainer, folder, view, interrupted, milestones, until_solved, track, ALONE, every_s, copy)
        run.go_on(seconds)
    return folder


@contextmanager
def features_read_once(request: RunRequest) -> Iterator[RunRequest]:
    """The request, where it keeps features mapped, with those of scene files in one file: see `mapped_scenes`.

    Raises:
        RunError, SceneError: see there; or there is no such device.
    """
    usable_device(request.device)  # before what takes long
    if request.feature_store == "mapped" and all(isinstance(scene.features, FileFeatures) for scene in request.scenes):
        with mapped_scenes(request.scenes) as (scenes, digests):
            yield replace(request, scenes=scenes, digests=digests)
    else:
        yield request


def train_part(
    request: RunRequest,
    folder: RunFolder,
    peers: Peers,
    *,
    show_progress: bool,
    until_solved: bool,
    track: TrackerName | None,
    checkpoint_s: float,
    copy_to: str | None = None,
) -> None:
    """Train as one of several workers, from the newest checkpoint of a run that has been begun, if it has one.

    Whoever started the workers holds the folder.

    Args:
        request, folder: what to train, where; a folder that all workers see.
        peers: the workers.
        show_progress, until_solved, track: as of `train`.
        checkpoint_s: seconds between checkpoints.
        copy_to: as of `train`; what lies there has been fetched.

    Raises:
        RunError, KeyboardInterrupt: as of `train`.
        LostPeer: another worker ended, or does not answer.
    """
    with ExitStack() as stack:
        trainer = stack.enter_context(closing(request.trainer(peers)))
        if peers.leads:
            folder.clear_parts()
        seconds = 0.0
        if any(folder.checkpoints.glob("frames-*")):
            seconds = _resumed(trainer, folder, peers)
        elif peers.leads:
            folder.forget_metrics_after(-1)
        found = [frames for [frames] in peers.told(trainer.frames)]
        if len(set(found)) > 1:
            problem = f"{folder.path}: the workers find checkpoints after {sorted(set(found))} frames"
            raise RunError(f"{problem}. Give a folder that all machines share as --out")
        peers.ready()
        if isinstance(trainer, ForeignTrainer):
            tensors = trainer.tensors()  # of all workers
            if peers.leads:
                trainer.try_agent(folder.read_record(), tensors)
        view = stack.enter_context(progress_view(trainer.learner.frames, show_progress and peers.leads))
        interrupted = stack.enter_context(interruption(of_several=True))
        copy = RunCopy(copy_to) if copy_to and peers.leads else None
        run = Running(trainer, folder, view, interrupted, (), until_solved, track, peers, checkpoint_s, copy)
        run.go_on(seconds)


def check_can_begin(request: RunRequest, out: Path, *, resume: bool, copy_to: str | None) -> None:
    """Refuse, before anything that takes long, to begin a run or to go on with one where `train` would refuse it.

    Raises:
        RunError: as of `train`, by its run folder.
        ClearwayError: as of `opened_copy`, or as of `train` by what its copy holds.
    """
    folder, record = RunFolder(out), record_of(request)
    folder.check_place()
    folder.check_not_held()
    folder.check_begin(record, resume)
    copy = _checked_copy(copy_to, folder, resume)
    if copy is not None and resume and not folder.exists:
        copy.check_goes_on(out, record)


def opened_copy(address: str | None, folder: RunFolder, resume: bool) -> RunCopy | None:
    """A run's copy, with what it holds in the run folder where that holds no run; None: there is to be none.

    Raises:
        ClearwayError: the store cannot be reached, or holds a run that is not to be written over.
    """
    copy = _checked_copy(address, folder, resume)
    if copy is not None and resume and not folder.exists:
        copy.restore(folder.path)
    return copy


def _checked_copy(address: str | None, folder: RunFolder, resume: bool) -> RunCopy | None:
    """A run's copy, which can be written; nothing is fetched. Raises ClearwayError as `opened_copy`."""
    if address is None:
        return None
    copy = RunCopy(address)
    if folder.exists:
        copy.check_fits(folder)
    elif not resume and copy.holds_a_run:
        raise RunError(f"{address}: holds a run already. Give --resume to go on with it, or another --copy-to")
    copy.check_writable()
    return copy


def told_of_other_bits(folder: RunFolder, request: RunRequest, other_bits: Sequence[str] | None) -> None:
    """Warn where there is more to train, in another way than the run began, see `RunRecord.other_bits`."""
    if other_bits and read_progress(newest_checkpoint(folder.checkpoints)).frames < request.learner.frames:
        told = f"{folder.path}: goes on with {', '.join(other_bits)}"
        warnings.warn(f"{told}; results will not be those of an uninterrupted run", stacklevel=3)


def _resumed(trainer: Learning, folder: RunFolder, peers: Peers = ALONE) -> float:
    """Load the newest checkpoint; returns the seconds trained so far."""
    checkpoint = newest_checkpoint(folder.checkpoints)
    progress = read_progress(checkpoint)
    tensors = {**read_training(checkpoint), **read_network(checkpoint)}
    try:
        trainer.load_tensors(tensors, progress.frames, progress.updates)
    except (LookupError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:300]
        raise RunError(
            f"{checkpoint}: does not fit its run ({reason}). Remove it, to go on from the one before, or train again"
        ) from error
    if peers.leads:
        folder.forget_metrics_after(progress.frames)
    return progress.seconds


def set_threads(count: int | None) -> None:
    """Let torch use `count` threads; None leaves its own choice. Results repeat bit for bit at one thread count."""
    if count is not None:
        torch.set_num_threads(count)
