"""Trainers of other packages' algorithms, behind checks of what they give; what they raise is told as their fault."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from operator import index
from typing import Any

from torch import Tensor

from clearway.errors import PluginError, kind_and_reason
from clearway.learn.checkpoint import written_and_read
from clearway.learn.figures import Figures
from clearway.learn.foreign_agent import made_agent
from clearway.learn.kinds import fits
from clearway.learn.learner import Learner
from clearway.learn.metrics_log import OWN_FIGURES
from clearway.learn.plugged import faults_of
from clearway.learn.run_record import RunRecord
from clearway.learn.running import Learning, acting_tensors
from clearway.learn.share import Share
from clearway.learn.statistics import EpisodeStatistics
from clearway.plugins import Plugin, find_plugin
from clearway.reward import Reward
from clearway.world.world import World

OFFERED = tuple(name for name in vars(Learning) if not name.startswith("_"))


def made_trainer(learner: Learner, world: World, reward: Reward, seed: int, share: Share | None = None) -> Learning:
    """A learner's trainer at its first frame; of several workers, that of one of them, which has a share.

    Raises:
        RunError: the seed or the settings do not fit the world, or the algorithm is not for several workers.
        PluginError: the algorithm is another package's and fails, or its trainer lacks what one has to offer.
    """
    called = "trainer" if share is None else "part_trainer"
    with faults_of(learner, called):
        trainer = (
            learner.trainer(world, reward, seed) if share is None else learner.part_trainer(world, reward, seed, share)
        )
    plugin = find_plugin("algorithms", learner.algorithm)
    if plugin is None:
        return trainer
    try:
        return _guarded(trainer, learner, plugin, called)
    except BaseException:
        with suppress(Exception):  # what is no trainer may lack it
            trainer.close()
        raise


def _guarded(trainer: Learning, learner: Learner, plugin: Plugin, called: str) -> ForeignTrainer:
    """Another's trainer at its first frame, behind its guard. Raises PluginError: it is none, or has nothing to do."""
    with faults_of(learner, called):
        lacks = [name for name in OFFERED if not hasattr(trainer, name)]
    if lacks:
        told = f"{plugin}: trainer gives {trainer!r:.60}, which lacks {', '.join(lacks)}"
        raise PluginError(f"{told} (clearway.learn.running.Learning). Ask its authors")
    if not isinstance(trainer.statistics, EpisodeStatistics):
        told = f"{plugin}: its trainer's statistics are {trainer.statistics!r:.60}, expected EpisodeStatistics"
        raise PluginError(f"{told} (clearway.learn.statistics). Ask its authors")
    guarded = ForeignTrainer(trainer, learner, plugin)
    if guarded.finished:
        raise PluginError(f"{plugin}: its trainer is finished before its first frame. Ask its authors")
    return guarded


class ForeignTrainer:
    """Another's trainer; see `Learning`.

    Whatever it raises, and what it gives that cannot be kept, is told of as its fault, a `PluginError` in one line.

    Args:
        trainer: the other's own.
        learner: the settings.
        plugin: whose it is.
    """

    def __init__(self, trainer: Learning, learner: Learner, plugin: Plugin) -> None:
        self.trainer, self.learner, self._plugin = trainer, learner, plugin

    @property
    def world(self) -> World:
        """See `Learning`."""
        return self.trainer.world

    @property
    def statistics(self) -> EpisodeStatistics:
        """See `Learning`."""
        return self.trainer.statistics

    @property
    def frames(self) -> int:
        """See `Learning`."""
        with faults_of(self.learner, "frames"):
            return index(self.trainer.frames)

    @property
    def updates(self) -> int:
        """See `Learning`."""
        with faults_of(self.learner, "updates"):
            return index(self.trainer.updates)

    @property
    def finished(self) -> bool:
        """See `Learning`."""
        with faults_of(self.learner, "finished"):
            return bool(self.trainer.finished)

    def update(self) -> Figures:
        """See `Learning`."""
        before = self.frames
        with faults_of(self.learner, "update"):
            found = self.trainer.update()
        if self.frames <= before:
            raise self._fault(f"update used no frames, and leaves them at {before}")
        if not isinstance(found, Mapping):
            raise self._fault(f"update gives {found!r:.40}, expected figures by name")
        return {name: self._figure(name, value) for name, value in found.items()}

    def _figure(self, name: object, value: object) -> float:
        if not isinstance(name, str) or name in OWN_FIGURES:
            raise self._fault(f"its figure {name!r:.40} has a name that is no text, or one of clearway's own")
        with faults_of(self.learner, f"its figure {name:.40}"):
            number: Any = value.item() if hasattr(value, "item") else value  # a number of NumPy's or PyTorch's
        if not fits(number, float):
            raise self._fault(f"its figure {name:.40} is {number!r:.40}, expected a finite number")
        return float(number)

    def tensors(self) -> dict[str, Tensor]:
        """See `Learning`; no two share memory, so that all can be written."""
        with faults_of(self.learner, "tensors"):
            found = self.trainer.tensors()
        return self._checked("tensors", found)

    def fixed_tensors(self) -> dict[str, Tensor]:
        """See `Learning`; copies, as they are written together with some of `tensors`."""
        with faults_of(self.learner, "fixed_tensors"):
            found = self.trainer.fixed_tensors()
        return {name: tensor.detach().clone() for name, tensor in self._checked("fixed_tensors", found).items()}

    def _checked(self, called: str, found: object) -> dict[str, Tensor]:
        if not isinstance(found, Mapping):
            raise self._fault(f"{called} gives {found!r:.40}, expected tensors by name")
        kept, places = dict[str, Tensor](), set[int]()
        for name, tensor in found.items():
            if not isinstance(name, str) or not isinstance(tensor, Tensor):
                raise self._fault(f"{called} gives {tensor!r:.40} by the name {name!r:.40}, expected a torch.Tensor")
            with faults_of(self.learner, f"{called}, {name:.40},"):
                place = tensor.untyped_storage().data_ptr()
                kept[name] = tensor.detach().clone() if place in places else tensor
            places.add(place)
        return kept

    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """See `Learning`. Raises LookupError, RuntimeError: the tensors do not fit."""
        with faults_of(self.learner, "load_tensors", (LookupError, RuntimeError)):
            self.trainer.load_tensors(tensors, frames, updates)
        if (self.frames, self.updates) != (frames, updates):
            found = f"{self.frames} frames and {self.updates} updates"
            raise self._fault(f"load_tensors leaves {found}, expected {frames} and {updates}")

    def close(self) -> None:
        """See `Learning`."""
        with faults_of(self.learner, "close"):
            self.trainer.close()

    def try_agent(self, record: RunRecord, tensors: Mapping[str, Tensor]) -> None:
        """Make an agent of its tensors, as one is made of a checkpoint's.

        Raises:
            PluginError: there will be none, or a checkpoint cannot keep them.
        """
        with faults_of(self.learner, "keeping its tensors"):
            written_and_read(tensors)
            acting = written_and_read(acting_tensors(self, tensors))
        try:
            made_agent(record, acting, self.frames)
        except (LookupError, RuntimeError, ValueError) as fault:
            reason = kind_and_reason(fault)
            given = f"given {', '.join(acting) or 'no tensors'}, by acts_on {self.learner.acts_on!r:.40}"
            raise self._fault(f"agent failed ({reason}), {given}") from fault

    def _fault(self, problem: str) -> PluginError:
        return PluginError(f"{self._plugin}: {problem}. Ask its authors")
