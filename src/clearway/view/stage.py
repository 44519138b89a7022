"""What a viewer shows: the scenes, and the agents that walk in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from PIL import Image

from clearway.agents.agent import Agent, State
from clearway.agents.by_pose import network_on_poses
from clearway.choices import ZoneLevel
from clearway.errors import RunError
from clearway.learn.foreign_agent import faults_of_agent, guarded_agent
from clearway.learn.load import TrainedNetwork, load_network, run_scenes, run_tables
from clearway.mapping.held import Held
from clearway.model.lookup import LookupNetwork
from clearway.reward import COLLISION_AWARE, Reward
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets
from clearway.world.world import World, scene_tables

PARTS = 16, 12  # of a picture, across and down


class StageAgent(Protocol):
    """An agent that walks in the viewer."""

    @property
    def name(self) -> str:
        """Stands on the page."""

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """All that it walks in."""

    @property
    def tells_values(self) -> bool:
        """Whether it tells values and probabilities, and was trained on the stage's targets."""

    @property
    def zone_level(self) -> ZoneLevel:
        """Whose zones it knows."""

    @property
    def reward(self) -> Reward:
        """What it earns."""

    def place(self, scene: str, target: int) -> World:
        """Its world with one target, any state in the scene's own numbering.

        Raises:
            SceneError: there is no such state, or too few lead to it.
        """

    def on_poses(self, placed: World) -> Agent:
        """Itself in a world from `place`; it goes by poses, or by features that the world has."""

    def holds(self, placed: World, start: int) -> Callable[[State], Held] | None:
        """What tells, by its state, what it holds in an episode from a state of the scene; None where it has no map."""


@dataclass(frozen=True)
class StageRun:
    """An agent with its run's scenes, in the run's order, see `StageAgent`.

    Attributes:
        name: of its run folder.
        trained: the network and its record.
        scenes: all that the run was trained on.
    """

    name: str
    trained: TrainedNetwork
    scenes: tuple[Scene, ...]

    tells_values = True

    @property
    def zone_level(self) -> ZoneLevel:
        """As it was trained."""
        return self.trained.record.zone_level

    @cached_property
    def world(self) -> World:
        """The tables of its scenes, without targets."""
        return run_tables(self.trained.record, self.scenes)

    @cached_property
    def _lookup(self) -> LookupNetwork:
        with faults_of_agent(self.trained, "lookup"):
            found: object = self.trained.lookup(self.world)
            if not isinstance(found, LookupNetwork):
                raise TypeError(f"gives {found!r:.40}, expected a LookupNetwork (clearway.model.lookup)")
        return found

    def make_ready(self) -> None:
        """Compute what all episodes share, so that one begins at once. Raises PluginError: a package's agent fails."""
        assert self._lookup is not None

    def place(self, scene: str, target: int) -> World:
        """See `StageAgent.place`."""
        return self.world.with_targets({scene: (target,)})

    def on_poses(self, placed: World) -> Agent:
        """Its network in a world from `place`; what a package's own `on_poses` does beside that is not shown."""
        scale = self.trained.record.learner.reward_scale
        with faults_of_agent(self.trained, "its network"):
            agent = network_on_poses(self._lookup.for_targets(placed.target_state), placed, scale)
        return guarded_agent(self.trained, agent)

    def holds(self, placed: World, start: int) -> None:
        """It keeps no map."""

    @property
    def reward(self) -> Reward:
        """What it learnt from, clipped if training clipped, so that values and rewards compare."""
        return self.trained.record.reward.as_known()


@dataclass(frozen=True)
class Stage:
    """Scenes and agents.

    Attributes:
        scenes: those that every agent knows.
        targets: states to offer as targets, by scene name: those that the first agent was trained on, if it was.
        agents: none, one or two.
    """

    scenes: tuple[Scene, ...]
    targets: dict[str, tuple[int, ...]]
    agents: tuple[StageAgent, ...] = ()
    _first: dict[str, int] = field(default_factory=dict, repr=False, compare=False)

    @property
    def zone_level(self) -> ZoneLevel:
        """Whose zones the map shows: those of poses or of cells."""
        return self.agents[0].zone_level if self.agents else "pose"

    @property
    def reward(self) -> Reward:
        """What a user who drives earns: as the first agent."""
        return self.agents[0].reward if self.agents else COLLISION_AWARE

    def first_target(self, name: str) -> int:
        """Of the targets offered in a scene the one whose picture tells most: no wall that fills it."""
        scene, offered = self.scenes[self.index(name)], self.targets[name]
        if name not in self._first:
            pictures = scene.observations
            self._first[name] = (
                offered[0] if pictures is None else max(offered, key=lambda state: variety(pictures[state]))
            )
        return self._first[name]

    def index(self, name: str) -> int:
        """Place of a scene in `scenes`.

        Raises:
            RunError: there is none of that name.
        """
        names = [scene.name for scene in self.scenes]
        if name not in names:
            raise RunError(f"scene {name}: not shown here. Choose one of {', '.join(names)}")
        return names.index(name)

    @cached_property
    def _user_world(self) -> World:
        bare = [replace(scene, features=None) for scene in self.scenes]
        return scene_tables(bare, self.zone_level)

    def user_world(self, scene: Scene, target: int) -> World:
        """The tables for a walk without an agent, with one target."""
        return self._user_world.with_targets({scene.name: (target,)})


def variety(picture: np.ndarray) -> float:
    """How much the large parts (16 x 12) of a picture (h, w, 3) uint8 differ: little where a wall fills it."""
    small = Image.fromarray(np.asarray(picture)).resize(PARTS, Image.Resampling.BOX)
    return float(np.asarray(small, np.float64).std(axis=(0, 1)).mean())


def scene_stage(scene: Scene) -> Stage:
    """A scene to walk through without an agent."""
    return Stage((scene,), {scene.name: default_targets(scene)})


def run_stage(folders: Sequence[Path], given: Sequence[Path | Scene] | None = None) -> Stage:
    """The agents of one or two runs, in the scenes that they share.

    Args:
        folders: of the runs.
        given: the scenes, or their files, if no longer where they were at training.

    Raises:
        RunError: a run cannot be used, or the two share no scene.
    """
    agents = []
    for folder, name in zip(folders, _names(folders), strict=True):
        trained = load_network(folder)
        agents.append(StageRun(name, trained, tuple(run_scenes(trained.record, given, tells_others=False))))
        agents[-1].make_ready()
    first, *others = agents
    scenes = tuple(scene for scene in first.scenes if all(_has(other, scene) for other in others))
    if not scenes:
        known = " and ".join(", ".join(scene.name for scene in shown.scenes) for shown in agents)
        raise RunError(
            f"{folders[1]}: trained on other rooms than {folders[0]} ({known}). Give runs that share a scene"
        )
    targets = first.trained.record.targets
    return Stage(scenes, {scene.name: targets[scene.name] for scene in scenes}, tuple(agents))


def _names(folders: Sequence[Path]) -> list[str]:
    """The folders' own names, or their whole paths where those are the same."""
    names = [folder.resolve().name for folder in folders]
    return names if len(set(names)) == len(names) else [str(folder) for folder in folders]


def _has(shown: StageRun, scene: Scene) -> bool:
    """The agent knows a scene of that name with the same poses and moves; its features may be others."""
    return any(
        own.name == scene.name
        and np.array_equal(own.graph, scene.graph)
        and np.array_equal(own.locations_m, scene.locations_m)
        and np.array_equal(own.headings_deg, scene.headings_deg)
        for own in shown.scenes
    )
