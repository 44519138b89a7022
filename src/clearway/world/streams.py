"""Random numbers with one stream an environment, independent of how many environments there are.

Counter based: number `n` of stream `key` is SplitMix64 at position `n` (Steele, Lea & Flood, OOPSLA 2014), a pure
function. A batch therefore draws for each environment what that environment would draw alone, on any device, and the
whole state of a stream is its counter.
"""

from __future__ import annotations

import torch
from torch import Tensor

_INCREMENT = 0x9E3779B97F4A7C15
_MIX_1 = 0xBF58476D1CE4E5B9
_MIX_2 = 0x94D049BB133111EB
_WORD = 1 << 64
AHEAD = 16  # numbers of a stream that are computed together


def _signed(word: int) -> int:
    """The int64 with the same 64 bits."""
    word %= _WORD
    return word - _WORD if word >= _WORD // 2 else word


def _shift_right(x: Tensor, bits: int) -> Tensor:
    """Logical shift of int64 words (torch's own shift keeps the sign)."""
    return (x >> bits) & ((1 << (64 - bits)) - 1)


def _mix(x: Tensor) -> Tensor:
    x = (x ^ _shift_right(x, 30)) * _signed(_MIX_1)
    x = (x ^ _shift_right(x, 27)) * _signed(_MIX_2)
    return x ^ _shift_right(x, 31)


def stream_keys(seeds: Tensor, purpose: int) -> Tensor:
    """One key an environment, (N,) int64: seeds (N,) int64 mixed with a number that tells streams of one seed apart."""
    return _mix(_mix(seeds + _signed(_INCREMENT)) + _signed(purpose * _INCREMENT))


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
    word = _mix(keys + (drawn + 1) * _signed(_INCREMENT))
    return _shift_right(word, 11).to(torch.float64) * 2.0**-53
