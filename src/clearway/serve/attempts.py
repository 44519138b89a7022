"""Wrong tokens, limited in rate: beyond it only tokens are looked at that were right before, from the same address."""

from __future__ import annotations

import hashlib
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import TypeVar

from clearway.serve.addresses import counted_as

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")
MINUTE_S = 60.0
MOST_KEPT = 10_000  # addresses, and tokens that were right


class Attempts:
    """Counts the wrong tokens of every address, see `counted_as`; a minute forgives as many as are allowed in it.

    Args:
        most: in a minute.
        clock: seconds, monotonic.
    """

    def __init__(self, most: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._most, self._clock = most, clock
        self._wrong: OrderedDict[str, tuple[float, float]] = OrderedDict()  # how many, and when they were counted
        self._right: OrderedDict[tuple[str, bytes], None] = OrderedDict()

    def may_try(self, address: str, token: str) -> bool:
        """Whether a token of this address is to be looked at."""
        address = counted_as(address)
        return self._count(address) + 1 <= self._most or (address, _digest(token)) in self._right

    def note(self, address: str, token: str, right: bool) -> None:
        """Keep what came of it."""
        address = counted_as(address)
        if right:
            _keep(self._right, (address, _digest(token)), None)
        else:
            _keep(self._wrong, address, (self._count(address) + 1, self._clock()))

    def _count(self, address: str) -> float:
        count, counted = self._wrong.get(address, (0.0, 0.0))
        return max(count - (self._clock() - counted) * self._most / MINUTE_S, 0.0)


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()


def _keep(kept: OrderedDict[Key, Value], key: Key, value: Value) -> None:
    """Keep it as the newest; the oldest goes where there are too many."""
    kept[key] = value
    kept.move_to_end(key)
    if len(kept) > MOST_KEPT:
        kept.popitem(last=False)
