"""Pictures with the poses in which they were taken, and where a further one was taken by what eyes tell of them.

Axes: B episodes, N pictures, F features, G cells along a side of the lattice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.mapping.beliefs import LatticePose, add_sighting
from clearway.mapping.settings import MappingSettings
from clearway.mapping.sight import Sight


@dataclass(frozen=True, eq=False)
class Pictures:
    """Pictures of known poses.

    Attributes:
        taken: (N, 3) int64, heading, row and column of the pose of each.
        features: (N, F) float16.
        described: (N, description_width), their descriptions.
    """

    taken: np.ndarray
    features: np.ndarray
    described: np.ndarray

    @classmethod
    def of(cls, taken: np.ndarray, features: np.ndarray, sight: Sight) -> Pictures:
        """With what eyes describe them by."""
        return cls(taken, features, sight.description(features).astype(np.float32))

    def alike(self, described: np.ndarray, count: int) -> np.ndarray:
        """Numbers (<= count,) of those that are most alike to one with a description, the likest first."""
        return np.argsort(-(self.described @ described), kind="stable")[:count]


def add_places(
    beliefs: Sequence[np.ndarray],
    seen: np.ndarray,
    known: Sequence[Pictures],
    sight: Sight,
    settings: MappingSettings,
    weight: float,
) -> None:
    """Add to beliefs where pictures were taken what eyes tell of them and of known ones.

    Args:
        beliefs: B times (4, G, G), at least one.
        seen: (B, F), features of the pictures.
        known: B times those that each is compared with, at least one in all.
        sight: compares them.
        settings: with how many each is compared, the most alike, and the lattice.
        weight: of what is told.
    """
    nearest = [own.alike(one, settings.compared) for own, one in zip(known, sight.description(seen), strict=True)]
    ends = np.cumsum([len(numbers) for numbers in nearest])
    first = np.concatenate([own.features[numbers] for own, numbers in zip(known, nearest, strict=True)])
    second = np.repeat(seen, np.diff(ends, prepend=0), axis=0)
    told = np.split(sight.whereabouts(first.astype(np.float32), second), ends[:-1])
    for belief, own, numbers, evidence in zip(beliefs, known, nearest, told, strict=True):
        for pose, one in zip(own.taken[numbers].tolist(), evidence, strict=True):
            add_sighting(belief, LatticePose(*pose), one, weight, settings.lattice)
