"""The generalist on the viewer's stage: in any scenes with pictures, after a tour of each where one is asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import ClassVar

from clearway.agents.agent import State
from clearway.agents.generalist import GENERALIST, Generalist
from clearway.agents.mapping import MappingAgent
from clearway.choices import ZoneLevel
from clearway.evaluation.tours import Tour, Touring, walk_tour
from clearway.mapping.held import Held, Laid
from clearway.reward import COLLISION_AWARE, Reward
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets
from clearway.view.stage import Stage
from clearway.world.world import World, make_world, scene_tables


@dataclass(frozen=True)
class StageGeneralist:
    """The generalist with scenes, see `stage.StageAgent`.

    Attributes:
        generalist: makes the agents.
        scenes: with features of its eyes.
        tour: steps in which it looks around in a scene before the first episode there.
    """

    generalist: Generalist
    scenes: tuple[Scene, ...]
    tour: int = 0
    _toured: dict[str, Tour] = field(default_factory=dict)
    _touring: threading.Lock = field(default_factory=threading.Lock)

    tells_values: ClassVar[bool] = False
    zone_level: ClassVar[ZoneLevel] = "pose"

    @property
    def name(self) -> str:
        """With the steps of its tours."""
        return f"{GENERALIST}, tour of {self.tour} steps" if self.tour else GENERALIST

    @property
    def reward(self) -> Reward:
        """It learns from none; what it would earn."""
        return COLLISION_AWARE

    @cached_property
    def _world(self) -> World:
        return scene_tables(self.scenes)

    def place(self, scene: str, target: int) -> World:
        """See `StageAgent.place`."""
        return self._world.with_targets({scene: (target,)})

    def on_poses(self, placed: World) -> MappingAgent:
        """Itself in a world from `place`; it goes by features."""
        if self.tour:
            return self.generalist.after(self._tour(_scene_name(placed)).state)
        return self.generalist.on_poses(placed)

    def holds(self, placed: World, start: int) -> Callable[[State], Held]:
        """What tells what it holds in an episode that began in a state of the scene."""
        name = _scene_name(placed)
        (scene,) = (scene for scene in self.scenes if scene.name == name)
        origin = self._tour(name).start if self.tour else start
        return partial(self.on_poses(placed).holds, laid=Laid.around(scene, origin))

    def make_ready(self) -> None:
        """Compute what an episode in the first scene needs."""
        if self.tour:
            self._tour(self.scenes[0].name)

    def _tour(self, name: str) -> Tour:
        """Of a scene, walked the first time."""
        with self._touring:
            if name not in self._toured:
                (scene,) = (scene for scene in self.scenes if scene.name == name)
                touring = Touring(self.generalist.explorer, self.generalist.after, self.tour)
                world = make_world([scene], {name: default_targets(scene)[:1]})
                self._toured[name] = walk_tour(world, touring, scene, seed=0)
            return self._toured[name]


def generalist_stage(scenes: Sequence[Scene], tour: int = 0) -> Stage:
    """The shipped generalist in some scenes.

    Raises:
        EncoderError: a scene has no pictures, or the eyes are damaged.
        SceneError: it cannot walk by the scenes' moves.
    """
    generalist = Generalist.shipped().stepping(scenes)
    shown = StageGeneralist(generalist, tuple(generalist.seen(scenes)), tour)
    shown.make_ready()
    return Stage(shown.scenes, {scene.name: default_targets(scene) for scene in shown.scenes}, (shown,))


def _scene_name(placed: World) -> str:
    return placed.scene_names[int(placed.target_scene[0])]
