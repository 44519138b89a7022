"""`summary`: a scene in figures, for `clearway scenes inspect` and for tables."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields

import numpy as np

from clearway.scenes import graph as graphs
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.feature_spread import FeatureSpread, feature_spread
from clearway.scenes.scene import Scene

PATH_SOURCES = 512  # states from which shortest paths are averaged, evenly spaced where there are more


@dataclass(frozen=True)
class SceneSummary:
    """A scene in figures; None where the scene has no such part.

    Attributes:
        name: of the scene.
        states: number of poses.
        cells: number of distinct locations.
        headings: at each of them; a turn is 360 degrees divided by it.
        components: number of strongly connected components of the graph.
        component_sizes: states in each component, the largest first.
        mean_degree: mean number of cells that can be entered from a cell.
        mean_shortest_path_steps: mean over ordered pairs of distinct states that are connected.
        blocked_share: share of moves (forward and backward, all states) that are blocked.
        encoder: name of the encoder that made the features.
        encoder_identity: short hash of the encoder.
        feature_count: F.
        spread: how well the features tell the states apart.
        picture_size: height and width of the pictures, pixels.
        sensors: what saw the scene, each in one line.
        source, room, seed: what made the scene, see `Provenance`.
    """

    name: str
    states: int
    cells: int
    headings: int
    components: int
    component_sizes: tuple[int, ...]
    mean_degree: float
    mean_shortest_path_steps: float | None
    blocked_share: float
    encoder: str | None
    encoder_identity: str | None
    feature_count: int | None
    spread: FeatureSpread | None
    picture_size: tuple[int, int] | None
    sensors: tuple[str, ...]
    source: str
    room: str | None
    seed: int | None

    def to_json(self) -> dict[str, object]:
        """As JSON values; the figures of `spread` stand beside the others."""
        figures = asdict(self)
        spread = figures.pop("spread") or dict.fromkeys(field.name for field in fields(FeatureSpread))
        return {**figures, **spread}


def summary(scene: Scene) -> SceneSummary:
    """The figures of a scene."""
    sizes = np.bincount(scene.components)
    moves = scene.graph[:, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]]
    features, encoder, pictures = scene.features, scene.encoder, scene.observations
    return SceneSummary(
        name=scene.name,
        states=scene.state_count,
        cells=scene.cell_count,
        headings=scene.heading_count,
        components=len(sizes),
        component_sizes=tuple(int(size) for size in sizes),
        mean_degree=mean_degree(scene),
        mean_shortest_path_steps=mean_shortest_path_steps(scene),
        blocked_share=float(np.mean(moves == BLOCKED)),
        encoder=None if encoder is None else encoder.name,
        encoder_identity=None if encoder is None else encoder.identity,
        feature_count=None if features is None else features.shape[1],
        spread=None if features is None else feature_spread(np.asarray(features)),
        picture_size=None if pictures is None else (pictures.shape[1], pictures.shape[2]),
        sensors=tuple(sensor.described() for sensor in scene.sensors),
        source=scene.made_by.source,
        room=scene.made_by.room,
        seed=scene.made_by.seed,
    )


def mean_degree(scene: Scene) -> float:
    """Mean number of other cells that a move from a cell leads to."""
    state, column = np.nonzero(scene.graph[:, [Action.MOVE_FORWARD, Action.MOVE_BACKWARD]] != BLOCKED)
    action = np.array([Action.MOVE_FORWARD, Action.MOVE_BACKWARD])[column]
    start, end = scene.cells[state], scene.cells[scene.graph[state, action]]
    doors = np.unique(np.stack([start, end], axis=1)[start != end], axis=0)
    return len(doors) / scene.cell_count


def mean_shortest_path_steps(scene: Scene) -> float | None:
    """Mean steps between distinct connected states; None where no two are connected.

    Scenes of more than `PATH_SOURCES` states are measured to as many targets, evenly spaced.
    """
    count = scene.state_count
    targets = np.linspace(0, count - 1, min(count, PATH_SOURCES)).round().astype(np.int64)
    steps = graphs.distances_to(scene.graph, targets)
    connected = steps > 0
    return float(steps[connected].mean()) if connected.any() else None
