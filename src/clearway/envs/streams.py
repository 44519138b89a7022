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
    """

    def __init__(self, seeds: Tensor, purpose: int) -> None:
        self.purpose = purpose
        self.keys = stream_keys(seeds, purpose)
        self.drawn = torch.zeros_like(self.keys)

    def reseed(self, seeds: Tensor, index: Tensor) -> None:
        """Begin the streams in index (B,) anew, from seeds (B,) int64; the others go on."""
        self.keys[index] = stream_keys(seeds, self.purpose)
        self.drawn[index] = 0

    def uniform(self, used: Tensor | None = None) -> Tensor:
        """The next number of every stream, (N,) float64 in [0, 1); only streams where `used` (N,) is True advance."""
        word = _mix(self.keys + (self.drawn + 1) * _signed(_INCREMENT))
        self.drawn = self.drawn + (1 if used is None else used.to(torch.int64))
        return _shift_right(word, 11).to(torch.float64) * 2.0**-53

    def at(self, index: Tensor) -> Tensor:
        """The next number of the streams in index (B,) int64, (B,) float64; only they advance."""
        drawn = self.drawn[index] + 1
        self.drawn[index] = drawn
        word = _mix(self.keys[index] + drawn * _signed(_INCREMENT))
        return _shift_right(word, 11).to(torch.float64) * 2.0**-53
