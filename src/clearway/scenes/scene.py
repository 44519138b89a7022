"""`Scene`: one room as the agent knows it. Every part of the project starts from this object.

Axis letters, here and everywhere: S states (poses), A actions, F features.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from clearway.errors import SceneError, printable
from clearway.scenes import graph as graphs
from clearway.scenes.held_out import held_out_poses
from clearway.scenes.sensors import RGB, SENSORS, Readings, Sensor, rgb


class Observations(Protocol):
    """What a sensor saw at each pose: an array, or a file read on demand. Index with an int, a slice or an int array.

    Colour pictures are (S, height, width, 3) uint8 RGB; `sensors.Sensor` says what others are.
    """

    @property
    def shape(self) -> tuple[int, ...]:
        """(S, ...)."""

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        """The observations asked for."""


class Features(Protocol):
    """The features of a scene: an array, or a file read when `numpy.asarray` makes an array of it."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(S, F)."""

    @property
    def dtype(self) -> np.dtype:
        """A float type."""

    def __array__(self) -> np.ndarray:
        """All features."""


@dataclass(frozen=True)
class TopView:
    """A picture of the room from above, for maps.

    Attributes:
        image: (height, width, 3) uint8 RGB; row 0 is the largest z, column 0 the smallest x.
        x_min_m, x_max_m, z_min_m, z_max_m: the rectangle of the floor that the picture covers, metres.
    """

    image: np.ndarray
    x_min_m: float
    x_max_m: float
    z_min_m: float
    z_max_m: float


@dataclass(frozen=True)
class EncoderRecord:
    """Which encoder made a scene's features, with all that is needed to make them again.

    Attributes:
        name: what the user asked for and every table prints, for example "random-resnet50".
        identity: short hash of weights and preprocessing; scenes trained together must agree in it.
        settings: seed, model name, picture size and the like (JSON values).
        arrays: the statistics that the settings do not determine, for example calibrated batch norms.
    """

    name: str
    identity: str
    settings: Mapping[str, object] = field(default_factory=dict)
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Provenance:
    """What made a scene.

    Attributes:
        source: "room" for our own rooms, else the importer's name, for example "thor_v1".
        room: name of the room builder, or None.
        seed: seed of the room builder, or None.
        versions: package versions that shaped the content, for example {"clearway": "0.1.0", "mujoco": "3.3.0"}.
        notes: whatever else the maker wants to keep (JSON values).
    """

    source: str
    room: str | None = None
    seed: int | None = None
    versions: Mapping[str, str] = field(default_factory=dict)
    notes: Mapping[str, object] = field(default_factory=dict)

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {**vars(self), "versions": dict(self.versions), "notes": dict(self.notes)}


@dataclass(frozen=True, eq=False)
class Scene:
    """One room: the picture, the features and the neighbours of every pose.

    Attributes:
        name: for example "bathroom" or "bathroom_02".
        observations: (S, height, width, 3) uint8 RGB first-person pictures, read lazily; None if the file has none.
        features: (S, F) float32 frozen features of the pictures, may be read lazily; None until they are encoded.
        locations_m: (S, 2) float64, x and z of the agent on the floor, metres.
        headings_deg: (S,) int64, 0 looks along +z, 90 along +x (a right turn adds `turn_deg`).
        graph: (S, A) int32, next state by action (`actions.Action`); -1 where the move is blocked.
        made_by: what made the scene.
        encoder: what made the features; None where features is None.
        cell_size_m: step length of a move, metres.
        top_view: picture from above for maps, or None.
        further: what sensors besides the colour camera measured, for example depth; one `Readings` each. A third sensor
            is one more of them. `sensors` and `seen_by` speak of all of them alike, colour included.
    """

    name: str
    observations: Observations | None
    features: Features | None
    locations_m: np.ndarray
    headings_deg: np.ndarray
    graph: np.ndarray
    made_by: Provenance
    encoder: EncoderRecord | None = None
    cell_size_m: float = 0.5
    top_view: TopView | None = None
    further: tuple[Readings, ...] = ()

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """What saw the scene, colour first; empty where nothing did."""
        colour = () if self.observations is None else (rgb(*self.observations.shape[1:3]),)
        return (*colour, *(readings.sensor for readings in self.further))

    def seen_by(self, name: str) -> Observations:
        """What a sensor saw at each pose, (S, *its shape), of its dtype and in its unit.

        Raises:
            SceneError: the scene has nothing of that sensor.
        """
        if name == RGB and self.observations is not None:
            return self.observations
        for readings in self.further:
            if readings.sensor.name == name:
                return readings
        found = ", ".join(sensor.name for sensor in self.sensors)
        problem = f"has {found}, but no {name}" if found else f"has no pictures, so no {name}"
        remedy = f"Build or import it again with --sensors {' '.join(dict.fromkeys((RGB, name)))}"
        if name not in SENSORS:
            remedy = f"Choose among {found or ', '.join(SENSORS)}, or give a scene with it"
        raise SceneError(self.name, problem, remedy)

    @property
    def state_count(self) -> int:
        """S, the number of poses."""
        return len(self.graph)

    @cached_property
    def cells(self) -> np.ndarray:
        """Cell of each state, (S,) int64: states that turns lead to share a cell; numbered by first appearance."""
        return graphs.turn_circles(self.graph)

    @property
    def heading_count(self) -> int:
        """Headings at a location: so many right turns lead back to the same state."""
        return int(np.count_nonzero(self.cells == 0))

    @property
    def turn_deg(self) -> float:
        """Angle of a turn, degrees."""
        return 360 / self.heading_count

    @property
    def cell_count(self) -> int:
        """Number of cells."""
        return int(self.cells.max()) + 1

    @cached_property
    def distances(self) -> np.ndarray:
        """(S, S) int32 shortest-path steps from row to column, from the graph alone; -1 where there is no path."""
        return graphs.distances(self.graph)

    def distances_to(self, targets: np.ndarray) -> np.ndarray:
        """(len(targets), S) int32 shortest-path steps to each target; -1 where there is no path."""
        return graphs.distances_to(self.graph, targets)

    @cached_property
    def components(self) -> np.ndarray:
        """(S,) int, strongly connected component of each state; 0 is the largest."""
        return graphs.components(self.graph)

    @cached_property
    def held_out(self) -> np.ndarray:
        """Which poses are held out of training where that is asked for, (S,) bool, see the module `held_out`."""
        return held_out_poses(self.name, self.cells, self.locations_m, self.cell_size_m)

    @property
    def encoder_name(self) -> str:
        """Name of what made the features."""
        return self.encoder.name if self.encoder else "unknown"

    def without_pictures(self) -> Scene:
        """The same scene with what training sees of it alone."""
        return self._of_same_graph(observations=None, top_view=None, further=())

    def with_features(self, features: Features, encoder: EncoderRecord | None) -> Scene:
        """The same scene with other features, (S, F) float32, and the record of what made them."""
        return self._of_same_graph(features=features, encoder=encoder)

    def _of_same_graph(self, **changes: Any) -> Scene:
        """The same scene with other parts, and what was found of its graph so far."""
        changed = replace(self, **changes)
        for name in ("cells", "components", "held_out"):
            if name in self.__dict__:
                changed.__dict__[name] = self.__dict__[name]
        return changed


def encoder_names(scenes: Iterable[Scene]) -> str:
    """Names of what made the scenes' features, each once, printable."""
    return printable(", ".join(sorted({scene.encoder_name for scene in scenes})))
