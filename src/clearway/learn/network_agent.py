"""A run's network as an agent, behind a camera or on the grid; what another package's raises is its fault."""

from __future__ import annotations

from typing import TYPE_CHECKING

from torch import Tensor

from clearway.agents.agent import Agent
from clearway.agents.arrival import Arrival
from clearway.agents.by_features import FeatureAgent
from clearway.learn.foreign_agent import ForeignTrained, faults_of_agent, is_ours, plugin_of
from clearway.model.policy import ScenePolicy
from clearway.perception.encoder import Encoder
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.world import World

if TYPE_CHECKING:
    from clearway.learn.load import TrainedNetwork


def policy_in(trained: TrainedNetwork, index: int) -> ScenePolicy:
    """What decides in one of the run's scenes, by features. Raises PluginError: another package's agent gives none."""
    with faults_of_agent(trained, "in_scene"):
        policy: object = trained.in_scene(index)
        if not isinstance(policy, ScenePolicy):
            raise TypeError(f"gives {policy!r:.40}, expected a ScenePolicy (clearway.model.policy)")
    return policy


def network_on_grid(trained: TrainedNetwork, world: World) -> Agent:
    """Its agent on the grid, in a world with the run's scenes.

    Raises:
        RunError: as of `TrainedNetwork.lookup`.
        PluginError, AgentError: another package's fails, then or walking.
    """
    plugin = plugin_of(trained)
    return trained.on_poses(world) if plugin is None else ForeignTrained(trained, plugin).on_poses(world)


class NetworkAgent(FeatureAgent):
    """Draws its actions by a run's network in one of the run's scenes.

    Args:
        trained: what the run has learnt.
        index: of the scene among the run's.
        encoder, arrival: see `FeatureAgent`.

    Raises:
        PluginError: another package's network fails, then or walking.
    """

    def __init__(
        self, trained: TrainedNetwork, index: int, encoder: Encoder | None = None, arrival: Arrival | None = None
    ) -> None:
        policy = policy_in(trained, index)
        with faults_of_agent(trained, "its network"):
            super().__init__(policy, encoder, arrival)
        self._trained = trained

    def _asked(self, history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """What the network says, see `ScenePolicy`."""
        if is_ours(self._trained):
            return super()._asked(history, target)
        with faults_of_agent(self._trained, "its network"):
            answers = super()._asked(history, target)
            for found, width in zip(answers, (ACTION_COUNT, 1), strict=True):
                if found.shape != (len(history), width) or not found.isfinite().all():
                    raise ValueError(f"gives {found!r:.40}, expected ({len(history)}, {width}) finite numbers")
        return answers
