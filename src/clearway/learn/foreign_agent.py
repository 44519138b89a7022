"""What algorithms of other packages have learnt, behind guards: what it raises is told of as its fault."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from torch import Tensor

from clearway.agents.agent import Agent
from clearway.agents.named import Foreign, checked_agent
from clearway.errors import PluginError
from clearway.learn.plugged import faults_of
from clearway.learn.run_record import RunRecord
from clearway.plugins import Plugin, find_plugin
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
    if plugin is None or type(agent).__module__.startswith("clearway."):  # what is ours needs no guard
        return agent
    with faults_of(learner, "agent"):
        lacks = [name for name in OFFERED if not hasattr(agent, name)]
    if lacks:
        told = f"{plugin}: agent gives {agent!r:.60}, which lacks {', '.join(lacks)}"
        raise PluginError(f"{told} (clearway.learn.load.TrainedAgent). Ask its authors")
    return ForeignTrained(agent, plugin)


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
