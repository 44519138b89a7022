"""`Takes`: several pictures of every pose, or features of them, of which an agent on the grid sees one a step.

Axis letters: S states of a scene, K takes, B episodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.world.randomness import UNIT, stream_keys, stream_words

TAKE_STREAM, BITS_STREAM = 13, 17
SMALL, BITS = 2.0**-9, 256


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


def never_again(seen: np.ndarray, seed: np.ndarray, step: np.ndarray) -> np.ndarray:
    """What is seen (B, ...), none of it twice to the bit, by episodes' seeds and steps (B,) int64.

    Takes are few, so that they come again, as a camera's pictures do not: to know them by their bits would be to know
    more than a camera tells. Of pictures, bytes, half of the first 256 lowest bits change; of features, floats, all but
    zeros do, by 1 in 512 at most.
    """
    keys = stream_keys(stream_words(stream_keys(seed, BITS_STREAM), step), BITS_STREAM)
    bytes_, shown = seen.dtype == np.uint8, seen.reshape(len(seen), int(np.prod(seen.shape[1:]))).copy()
    count = min(BITS, shown.shape[1]) if bytes_ else shown.shape[1]
    words = stream_words(keys[:, None], np.arange(count, dtype=np.int64))
    if bytes_:
        shown[:, :count] ^= (words & 1).astype(np.uint8)
    else:
        shown *= 1 + SMALL * (2 * (words * UNIT) - 1)
    return shown.reshape(seen.shape)


def take_at(seed: np.ndarray, step: np.ndarray, count: int) -> np.ndarray:
    """Which of `count` takes is seen, (B,) int64: it follows from an episode's seed and its step, (B,) int64 both."""
    return stream_words(stream_keys(seed, TAKE_STREAM), step) % count
