"""Fair shares: who has used the least lately comes next."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

HALF_LIFE_S = 10.0  # of what has been used


class Shares:
    """Seconds that each owner has used lately: what was used counts half after `HALF_LIFE_S`.

    Args:
        clock: seconds, monotonic.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._used: dict[str, tuple[float, float]] = {}  # seconds, and when they were counted

    def used(self, owner: str) -> float:
        """Seconds, as they count now."""
        seconds, counted = self._used.get(owner, (0.0, 0.0))
        return seconds * 0.5 ** ((self._clock() - counted) / HALF_LIFE_S)

    def add(self, owner: str, seconds: float) -> None:
        """Count seconds."""
        self._used[owner] = self.used(owner) + seconds, self._clock()


class FairTurns:
    """So many turns at a time; those who wait get theirs in the order of what they have used, then of their coming.

    Args:
        most: at a time.
        shares: counts the seconds of every turn.
    """

    def __init__(self, most: int, shares: Shares) -> None:
        self._free, self._shares = most, shares
        self._waiting: dict[str, deque[asyncio.Future[None]]] = {}

    @asynccontextmanager
    async def turn(self, owner: str) -> AsyncIterator[None]:
        """A turn of an owner's."""
        await self._begin(owner)
        begun = time.monotonic()
        try:
            yield
        finally:
            self._shares.add(owner, time.monotonic() - begun)
            self._next()

    async def _begin(self, owner: str) -> None:
        if self._free:
            self._free -= 1
            return
        mine: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(owner, deque()).append(mine)
        try:
            await mine
        except asyncio.CancelledError:
            if mine.done() and not mine.cancelled():  # it had just become mine
                self._next()
            raise

    def _next(self) -> None:
        for owner in sorted(self._waiting, key=self._shares.used):
            line = self._waiting[owner]
            while line and line[0].done():  # given up
                line.popleft()
            if line:
                return line.popleft().set_result(None)
            del self._waiting[owner]
        self._free += 1
