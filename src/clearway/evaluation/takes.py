"""`Takes`: several pictures of every pose, or features of them, of which an agent on the grid sees one a step.

Axis letters: S states of a scene, K takes, B episodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.world.randomness import stream_keys, stream_words

TAKE_STREAM = 13


@dataclass(frozen=True, eq=False)
class Takes:
    """What else is seen in the poses of a world.

    Attributes:
        count: K, takes of every pose.
        seen: by the names of what agents see, of each scene in the world's order (S, K, ...).
        made: how they differ from the scenes' own pictures, JSON values for tables and files.
    """

    count: int
    seen: Mapping[str, Sequence[np.ndarray]]
    made: Mapping[str, object] = field(default_factory=dict)

    def of_scene(self, number: int) -> Takes:
        """Those of one scene."""
        return replace(self, seen={name: parts[number : number + 1] for name, parts in self.seen.items()})


def take_at(seed: np.ndarray, step: np.ndarray, count: int) -> np.ndarray:
    """Which of `count` takes is seen, (B,) int64: it follows from an episode's seed and its step, (B,) int64 both."""
    return stream_words(stream_keys(seed, TAKE_STREAM), step) % count
