"""Eyes that tell the truth: features are poses, and what is told of them is right as far as it can be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.perception.around import PLACES_M
from clearway.perception.whereabouts import ELSEWHERE, bin_of
from clearway.scenes.scene import EncoderRecord, Scene

SURE, REACH_M = 8.0, 3.0
CELL_M = 0.5


class PerfectSight:
    """Stands in for `mapping.sight.Sight` in one scene.

    It sees what looks the same way, not behind it, within three metres; and cells that lie ahead.
    """

    feature_count = 4

    def __init__(self, scene: Scene) -> None:
        self._cells = {tuple(cell) for cell in np.rint(scene.locations_m / CELL_M).astype(int).tolist()}

    def description(self, features: np.ndarray) -> np.ndarray:
        """Unit vectors, alike for near poses."""
        heading = np.radians(features[:, 2])
        apart = np.column_stack([features[:, :2] / 3, 3 * np.cos(heading), 3 * np.sin(heading)])
        return apart / np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-6)

    def stands(self, features: np.ndarray) -> np.ndarray:
        """Whether there is a cell at each of the places ahead."""
        found = np.zeros((len(features), len(PLACES_M)), np.float32)
        for row, (x, z, heading_deg, _) in enumerate(features):
            ahead, right = _axes(heading_deg)
            for number, (ahead_m, right_m) in enumerate(PLACES_M):
                if ahead_m >= max(CELL_M, abs(right_m)):
                    cell = np.rint((x, z) + (ahead * ahead_m + right * right_m) / CELL_M).astype(int)
                    found[row, number] = 3.0 if tuple(cell) in self._cells else -3.0
        return found

    def whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """The right bin, where it can be seen."""
        found = np.zeros((len(first), ELSEWHERE), np.float32)
        for row, (here, there) in enumerate(zip(first, second, strict=True)):
            ahead, right = _axes(here[2])
            way_m = (there[:2] - here[:2]) * CELL_M
            ahead_m, right_m, turn_deg = way_m @ ahead, way_m @ right, there[2] - here[2]
            seen = turn_deg % 360 < 1 and abs(right_m) <= abs(ahead_m) + 0.6 and np.hypot(ahead_m, right_m) < REACH_M
            if here[3] and there[3] and seen:
                found[row] = -SURE / 2
                found[row, int(bin_of(*(np.array([value]) for value in (ahead_m, right_m, turn_deg)))[0])] = SURE
        return found


def seen_perfectly(scene: Scene) -> Scene:
    """The scene with features that `PerfectSight` knows: x and z in cells, heading, and 1."""
    cells = np.rint(scene.locations_m / CELL_M)
    features = np.column_stack([cells, scene.headings_deg, np.ones(len(cells))]).astype(np.float32)
    return replace(scene, features=features, encoder=EncoderRecord("perfect", "", {}))


def _axes(heading_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """x and z of a metre ahead, and of one to the right."""
    heading = np.radians(heading_deg)
    return np.array([np.sin(heading), np.cos(heading)]), np.array([np.cos(heading), -np.sin(heading)])
