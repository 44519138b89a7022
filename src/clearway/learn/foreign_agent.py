"""What algorithms of other packages have learnt, behind guards: what it raises is told of as its fault."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, TypeGuard

from torch import Tensor

from clearway.agents.agent import Agent
from clearway.agents.named import Foreign, checked_agent
from clearway.errors import PluginError
from clearway.learn.plugged import faults_of
from clearway.learn.recurrent import TrainedRecurrent
from clearway.learn.run_record import RunRecord
from clearway.perception.eyes import EyesEncoder
from clearway.plugins import Plugin, find_plugin
from clearway.scenes.scene import Scene
from clearway.world.world import World

if TYPE_CHECKING:
    from clearway.learn.load import TrainedAgent

OFFERED = ("record", "frames", "on_poses")  # by `TrainedAgent`


def made_agent(record: RunRecord, tensors: Mapping[str, Tensor], frames: int) -> TrainedAgent:
    """The agent of a run from the tensors of its checkpoint, after that many frames, see `Learner.agent`.

    Raises:
        LookupError, RuntimeError, ValueError: the tensors do not fit the run.
        PluginError: the algorithm is another package's, and gives no agent.
    """
    learner = record.learner
    with faults_of(learner, "agent", (LookupError, RuntimeError, ValueError)):
        agent = learner.agent(record, tensors, frames)
    plugin = find_plugin("algorithms", learner.algorithm)
    if plugin is None or is_ours(agent):
        return agent
    with faults_of(learner, "agent"):
        lacks = [name for name in OFFERED if not hasattr(agent, name)]
    if lacks:
        told = f"{plugin}: agent gives {agent!r:.60}, which lacks {', '.join(lacks)}"
        raise PluginError(f"{told} (clearway.learn.load.TrainedAgent). Ask its authors")
    return ForeignRecurrent(agent, plugin) if isinstance(agent, TrainedRecurrent) else ForeignTrained(agent, plugin)


def is_ours(thing: object) -> bool:
    """It is of a class of clearway's, which needs no guard."""
    return type(thing).__module__.startswith("clearway.")


def plugin_of(agent: TrainedAgent) -> Plugin | None:
    """Whose class it is of; None: ours."""
    return None if is_ours(agent) else find_plugin("algorithms", agent.record.learner.algorithm)


@contextmanager
def faults_of_agent(agent: TrainedAgent, what: str) -> Iterator[None]:
    """Tell of what an agent of a package's own class raises as that package's fault, see `faults_of`.

    Raises:
        PluginError: it failed.
    """
    with nullcontext() if is_ours(agent) else faults_of(agent.record.learner, what):
        yield


def guarded_agent(trained: TrainedAgent, agent: Agent) -> Agent:
    """The agent that was made of what a run has learnt; behind a guard where that is of a package's own class."""
    plugin = plugin_of(trained)
    return agent if plugin is None else Foreign(agent, str(plugin))


class ForeignTrained:
    """Another's trained agent; see `TrainedAgent`. What else it has is found here too.

    Args:
        trained: the other's own.
        plugin: whose it is.
    """

    def __init__(self, trained: TrainedAgent, plugin: Plugin) -> None:
        self.trained, self._plugin = trained, plugin

    def __repr__(self) -> str:
        return repr(self.trained)

    def __getattr__(self, name: str) -> Any:
        """What it has beside the below."""
        if name in ("trained", "_plugin"):  # of a copy that is being made
            raise AttributeError(name)
        return getattr(self.trained, name)

    @property
    def record(self) -> RunRecord:
        """Of its run."""
        return self.trained.record

    @property
    def frames(self) -> int:
        """It has learnt from."""
        return self.trained.frames

    def on_poses(self, world: World) -> Agent:
        """Its agent on the grid, see `TrainedAgent`.

        Raises:
            PluginError, AgentError: it fails, or gives no agent.
        """
        with faults_of(self.record.learner, "on_poses"):
            agent = self.trained.on_poses(world)
        return Foreign(checked_agent(str(self._plugin), agent), str(self._plugin))


class ForeignRecurrent(ForeignTrained):
    """Another's trained agent that is derived from `TrainedRecurrent`, and goes by pictures in any room as that does.

    What it raises in doing so is a PluginError.
    """

    trained: TrainedRecurrent

    def behind_camera(self) -> Agent:
        """Its agent that sees pictures, see `TrainedRecurrent`. Raises AgentError where it gives none."""
        with faults_of(self.record.learner, "behind_camera"):
            agent = self.trained.behind_camera()
        return Foreign(checked_agent(str(self._plugin), agent), str(self._plugin))

    @property
    def encoder(self) -> EyesEncoder:
        """Its own eyes."""
        with faults_of(self.record.learner, "encoder"):
            return self.trained.encoder

    def warn_of_aspect(self, scenes: Sequence[Scene]) -> None:
        """See `TrainedRecurrent`."""
        with faults_of(self.record.learner, "warn_of_aspect"):
            self.trained.warn_of_aspect(scenes)

    def seen(self, scenes: Sequence[Scene]) -> list[Scene]:
        """Any scenes with pictures as its own eyes see them, see `TrainedRecurrent`."""
        with faults_of(self.record.learner, "seen"):
            return self.trained.seen(scenes)


def goes_anywhere(agent: object) -> TypeGuard[TrainedRecurrent | ForeignRecurrent]:
    """Whether it is a run's agent that goes by pictures in any room; others are bound to the scenes of their run."""
    return isinstance(agent, TrainedRecurrent | ForeignRecurrent)
