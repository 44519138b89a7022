"""`Generalist`: the agent that comes with clearway. It walks in rooms that it has never entered, by its own eyes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from clearway.agents.agent import State
from clearway.agents.exploring import Explorer
from clearway.agents.mapping import MappingAgent
from clearway.agents.tour_map import map_of
from clearway.choices import GENERALIST
from clearway.errors import SceneError
from clearway.mapping.lattice import HEADINGS
from clearway.mapping.room_map import RoomMap
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight
from clearway.perception import eyes
from clearway.perception.encode import encoded
from clearway.perception.encoder import Encoder
from clearway.perception.eyes import EyesEncoder
from clearway.scenes.aspect import warn_of_aspect
from clearway.scenes.scene import Scene

if TYPE_CHECKING:
    from clearway.world.world import Steps, World

__all__ = ["GENERALIST", "Generalist"]

STEPS_M = 0.2, 1.0
"""The shortest and the longest move that it can walk by."""
SLACK = 1e-3  # share by which moves may differ
DECIMALS = 4  # of a move in metres: float32 is told from what was meant


@dataclass(frozen=True)
class Generalist:
    """Makes agents that go by the same eyes.

    Attributes:
        encoder: the eyes; its record has the `shape` of their network.
        sight: compares features of theirs.
        settings: how the agents weigh what they are told.
    """

    encoder: Encoder
    sight: Sight
    settings: MappingSettings = field(default_factory=MappingSettings)

    @classmethod
    def shipped(cls) -> Generalist:
        """By the eyes that come with this version. Raises EncoderError where they are missing or damaged."""
        return cls.by_eyes(eyes.from_record(eyes.find_record()))

    @classmethod
    def by_eyes(cls, encoder: EyesEncoder) -> Generalist:
        """By eyes on PyTorch."""
        from clearway.mapping.eyes_sight import EyesSight

        return cls(encoder, EyesSight(encoder.eyes))

    @property
    def picture_px(self) -> tuple[int, int]:
        """Height and width of the pictures that the eyes were taught on."""
        shape: Any = self.encoder.record.settings["shape"]
        return int(shape["height_px"]), int(shape["width_px"])

    def stepping(self, scenes: Sequence[Scene | Steps]) -> Generalist:
        """The same, walking by moves as long as those of the scenes.

        Raises:
            SceneError: moves are too long or too short, differ between scenes, or turns are no quarters.
        """
        step_m, shortest_m, longest_m = round(scenes[0].cell_size_m, DECIMALS), *STEPS_M
        for scene in scenes:
            remedy = "Build or import the scene with these, or train an agent of its own"
            if scene.turn_deg != 360 / HEADINGS:
                problem = f"turns of {scene.turn_deg:g} degrees, and the {GENERALIST} walks by quarter turns"
                raise SceneError(scene.name, problem, remedy)
            if not shortest_m <= round(scene.cell_size_m, DECIMALS) <= longest_m:
                allowed = f"{shortest_m:g} to {longest_m:g} m"
                problem = f"moves of {scene.cell_size_m:g} m, and the {GENERALIST} walks by {allowed}"
                raise SceneError(scene.name, problem, remedy)
            if not math.isclose(scene.cell_size_m, step_m, rel_tol=SLACK):
                problem = f"moves of {scene.cell_size_m:g} m, and in {scenes[0].name} they are of {step_m:g} m"
                raise SceneError(scene.name, problem, "Walk in each by itself")
        return replace(self, settings=replace(self.settings, step_m=step_m))

    def warn_of_aspect(self, scenes: Sequence[Scene]) -> None:
        """Warn (AspectWarning) where pictures have another aspect than those that the eyes were taught on."""
        warn_of_aspect(scenes, self.picture_px, stacklevel=3)

    def on_poses(self, world: World) -> MappingAgent:
        """The agent on the grid: it goes by features of its eyes, in any world."""
        return MappingAgent(self.sight, settings=self.settings)

    def behind_camera(self, known: RoomMap | None = None) -> MappingAgent:
        """The agent that sees pictures, in a room of which a tour has made a map, or in any."""
        return MappingAgent(self.sight, self.encoder, known, self.settings)

    def explorer(self, steps: int, *, camera: bool = False) -> Explorer:
        """Who tours a room, for so many steps: on the grid, or behind a camera."""
        return Explorer(self.sight, steps, self.encoder if camera else None, settings=self.settings)

    def after(self, state: State, *, camera: bool = False) -> MappingAgent:
        """The agent that knows a room by an explorer's state at the end of its tour; where, as of `explorer`."""
        known = map_of(state, self.sight, self.settings)
        return MappingAgent(self.sight, self.encoder if camera else None, known, self.settings)

    def seen(self, scenes: Sequence[Scene]) -> list[Scene]:
        """Any scenes with pictures as its own eyes see them.

        Raises:
            EncoderError: a scene has no pictures.

        Warns:
            AspectWarning: a scene's pictures have another aspect than those that the eyes were taught on.
        """
        self.warn_of_aspect(scenes)
        return [encoded(scene, self.encoder) for scene in scenes]
