"""`Generalist`: the agent that comes with clearway. It walks in rooms that it has never entered, by its own eyes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from clearway.agents.agent import State
from clearway.agents.exploring import Explorer, map_of
from clearway.agents.mapping import MappingAgent
from clearway.errors import SceneError
from clearway.mapping.lattice import HEADINGS, STEP_M
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.perception import eyes
from clearway.perception.encode import encoded
from clearway.perception.eyes import EyesEncoder
from clearway.scenes.scene import Scene
from clearway.world.world import World

GENERALIST = "generalist"


@dataclass(frozen=True)
class Generalist:
    """Makes agents that go by the same eyes.

    Attributes:
        encoder: the eyes.
        settings: how the agents weigh what they are told.
    """

    encoder: EyesEncoder
    settings: MappingSettings = field(default_factory=MappingSettings)

    @classmethod
    def shipped(cls) -> Generalist:
        """By the eyes that come with this version. Raises EncoderError where they are missing or damaged."""
        return cls(eyes.from_record(eyes.find_record()))

    def on_poses(self, world: World) -> MappingAgent:
        """The agent on the grid: it goes by features of its eyes, in any world."""
        return MappingAgent(self._sight, settings=self.settings)

    def behind_camera(self) -> MappingAgent:
        """The agent that sees pictures."""
        return MappingAgent(self._sight, self.encoder, settings=self.settings)

    def explorer(self, steps: int, *, camera: bool = False) -> Explorer:
        """Who tours a room, for so many steps: on the grid, or behind a camera."""
        return Explorer(self._sight, steps, self.encoder if camera else None, settings=self.settings)

    def after(self, state: State, *, camera: bool = False) -> MappingAgent:
        """The agent that knows a room by an explorer's state at the end of its tour; where, as of `explorer`."""
        encoder = self.encoder if camera else None
        return MappingAgent(self._sight, encoder, known=map_of(state), settings=self.settings)

    def seen(self, scenes: Sequence[Scene]) -> list[Scene]:
        """Any scenes with pictures as its own eyes see them.

        Raises:
            EncoderError: a scene has no pictures.
            SceneError: a step or a turn there is not as long as its own.
        """
        for scene in scenes:
            check_steps(scene)
        return [encoded(scene, self.encoder) for scene in scenes]

    @property
    def _sight(self) -> Sight:
        return Sight(self.encoder.eyes)


def check_steps(scene: Scene) -> None:
    """Raise SceneError where a move is not a step of the generalist's lattice, or a turn no quarter."""
    if math.isclose(scene.cell_size_m, STEP_M) and scene.turn_deg == 360 / HEADINGS:
        return
    found = f"{scene.cell_size_m:g} m and turns of {scene.turn_deg:g} degrees"
    problem = f"moves of {found}, and the {GENERALIST} walks by moves of {STEP_M:g} m and quarter turns"
    raise SceneError(scene.name, problem, "Build or import the scene with these, or train an agent of its own")
