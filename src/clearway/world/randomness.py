"""Random numbers and draws by them, as pure functions; alike for NumPy arrays and torch tensors.

Counter based: word `n` of the stream `key` is SplitMix64 at position `n` (Steele, Lea & Flood, OOPSLA 2014).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from torch import Tensor

Numbers = TypeVar("Numbers", np.ndarray, "Tensor")

UNIT = 2.0**-53  # a word shifted right by WORD_SHIFT, times this, is in [0, 1)
WORD_SHIFT = 11
_INCREMENT = 0x9E3779B97F4A7C15
_MIX_1 = 0xBF58476D1CE4E5B9
_MIX_2 = 0x94D049BB133111EB
_WORD = 1 << 64


def stream_keys(seeds: Numbers, purpose: int) -> Numbers:
    """One key a stream, (N,) int64: seeds (N,) int64 mixed with a number that tells streams of one seed apart."""
    return _mix(_mix(seeds + _signed(_INCREMENT)) + _signed(purpose * _INCREMENT))


def stream_words(keys: Numbers, drawn: Numbers) -> Numbers:
    """Whole numbers in [0, 2^53), int64: what streams with these keys give after so many, int64 both."""
    return _shift_right(_mix(keys + (drawn + 1) * _signed(_INCREMENT)), WORD_SHIFT)


def drawn_by(probabilities: Numbers, uniform: Numbers) -> Numbers:
    """Actions (B,) int64 drawn by probabilities (B, A) float64, which need not sum to one, from uniform (B,) in [0, 1).

    In float64: in float32 a number near 1 would round to 1, and the last action be drawn where it is impossible.
    """
    bounds = probabilities.cumsum(1)
    return ((uniform * bounds[:, -1])[:, None] >= bounds[:, :-1]).sum(1)


def _signed(word: int) -> int:
    """The int64 with the same 64 bits."""
    word %= _WORD
    return word - _WORD if word >= _WORD // 2 else word


def _shift_right(x: Numbers, bits: int) -> Numbers:
    """Logical shift of int64 words (the shift of both libraries keeps the sign)."""
    return (x >> bits) & ((1 << (64 - bits)) - 1)


def _mix(x: Numbers) -> Numbers:
    x = (x ^ _shift_right(x, 30)) * _signed(_MIX_1)
    x = (x ^ _shift_right(x, 27)) * _signed(_MIX_2)
    return x ^ _shift_right(x, 31)
