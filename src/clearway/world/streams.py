"""Random numbers with one stream an environment, independent of how many environments there are.

Counter based, see `randomness`: a batch therefore draws for each environment what that environment would draw alone, on
any device, and the whole state of a stream is its counter.
"""

from __future__ import annotations

import torch
from torch import Tensor

from clearway.world.randomness import UNIT, stream_keys, stream_words

AHEAD = 16  # numbers of a stream that are computed together


class Streams:
    """N random streams.

    Args:
        seeds: (N,) int64, one a stream.
        purpose: tells apart streams that share seeds (starts, actions, ...).

    Attributes:
        drawn: (N,) int64, numbers drawn from each stream so far; set by `seek`.
    """

    def __init__(self, seeds: Tensor, purpose: int) -> None:
        self.purpose = purpose
        self.keys = stream_keys(seeds, purpose)
        self.seek(torch.zeros_like(self.keys))

    def seek(self, drawn: Tensor) -> None:
        """Go on as after so many numbers of each stream, (N,) int64."""
        self.drawn = drawn
        self._calls_left = 0

    def reseed(self, seeds: Tensor, index: Tensor) -> None:
        """Begin the streams in index (B,) anew, from seeds (B,) int64; the others go on."""
        self.keys[index] = stream_keys(seeds, self.purpose)
        self.drawn[index] = 0
        self._calls_left = 0

    def uniform(self, used: Tensor | None = None) -> Tensor:
        """The next number of every stream, (N,) float64 in [0, 1); only streams where `used` (N,) is True advance."""
        if not self._calls_left:
            self._look_ahead()
        number = self._ahead.gather(0, (self.drawn - self._ahead_from)[None])[0]
        self.drawn = self.drawn + (1 if used is None else used)
        self._calls_left -= 1
        return number

    def at(self, index: Tensor) -> Tensor:
        """The next number of the streams in index (B,) int64, (B,) float64; only they advance."""
        drawn = self.drawn[index]
        self.drawn[index] = drawn + 1
        self._calls_left = 0
        return _numbers(self.keys[index], drawn)

    def _look_ahead(self) -> None:
        """Compute the next `AHEAD` numbers of every stream, which takes hardly longer than computing one."""
        place = torch.arange(AHEAD, device=self.keys.device)[:, None]
        self._ahead_from = self.drawn.clone()
        self._ahead = _numbers(self.keys, self._ahead_from + place)  # (AHEAD, N)
        self._calls_left = AHEAD


def _numbers(keys: Tensor, drawn: Tensor) -> Tensor:
    """The number after so many, int64, of streams with these keys, int64: float64 in [0, 1)."""
    return stream_words(keys, drawn).to(torch.float64) * UNIT
