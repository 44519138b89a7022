"""Fair shares: who has used the least lately comes next; and of what all share, a part is kept for each."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, deque
from collections.abc import AsyncIterator, Callable, Collection, Mapping
from contextlib import asynccontextmanager

HALF_LIFE_S = 10.0  # of what has been used
LEAST_S = 0.01  # of use lately, of whom there is reason to think
MOST_SHARES = 4  # no owner takes more than this part of the places, where there are so many owners


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

    def is_above_mean(self, owner: str) -> bool:
        """Whether an owner has used more lately than those did, on average, who have used something."""
        others = [seconds for name in self._used if (seconds := self.used(name)) > LEAST_S]
        return bool(others) and self.used(owner) > sum(others) / len(others)

    def add(self, owner: str, seconds: float) -> None:
        """Count seconds."""
        self._used[owner] = self.used(owner) + seconds, self._clock()


class FairTurns:
    """So many turns at a time; those who wait get theirs in the order of what they have used, then of their coming.

    The last one that is free is kept for who has not used more than the mean: they need not wait for those who have.

    Args:
        most: at a time.
        shares: counts the seconds of every turn.
    """

    def __init__(self, most: int, shares: Shares) -> None:
        self._free, self._kept, self._shares = most, int(most > 1), shares
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
            self._end()

    async def _begin(self, owner: str) -> None:
        if self._is_free_for(owner):
            self._free -= 1
            return
        mine: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(owner, deque()).append(mine)
        try:
            await mine
        except asyncio.CancelledError:
            if mine.done() and not mine.cancelled():  # it had just become mine
                self._end()
            raise

    def _is_free_for(self, owner: str) -> bool:
        return self._free > (self._kept if self._shares.is_above_mean(owner) else 0)

    def _end(self) -> None:
        """Give a turn to the next, if there is one."""
        self._free += 1
        for owner in sorted(self._waiting, key=self._shares.used):
            line = self._waiting[owner]
            while line and line[0].done():  # given up
                line.popleft()
            if not line:
                del self._waiting[owner]
            elif self._is_free_for(owner):
                self._free -= 1
                return line.popleft().set_result(None)


class Places:
    """Places that owners share: sessions, pictures that wait, bytes. Each finds a part free, whatever others hold.

    Half of the places are kept for the owners, as many for each, but at least one where that is possible. The others
    are for whoever comes first, to a quarter of all places for an owner; a half or a third of two or three owners.

    Args:
        most: places there are.
        owners: gives the names for which places are kept.
        held: places that are taken, by owner.
    """

    def __init__(self, most: int, owners: Callable[[], Collection[str]], held: Mapping[str, int] | None = None) -> None:
        self.most, self._owners = most, owners
        self._held = Counter[str](held)

    @property
    def taken(self) -> int:
        """By all owners."""
        return self._held.total()

    def held(self, owner: str) -> int:
        """By one owner."""
        return self._held[owner]

    def take(self, owner: str, count: int = 1) -> bool:
        """Whether there was room for an owner's; then it is taken."""
        wanted = self._held[owner] + count
        owners, kept = self._owners(), self._kept()
        if self.taken + count > self.most:
            return False
        if wanted > (kept if owner in owners else 0):
            others = sum(max(kept - self._held[name], 0) for name in owners if name != owner)  # kept, and not taken yet
            if wanted > self.most // min(len(owners), MOST_SHARES) or self.taken + count + others > self.most:
                return False
        self._held[owner] = wanted
        return True

    def free(self, owner: str, count: int = 1) -> None:
        """Give places back."""
        self._held[owner] -= count
        if not self._held[owner]:
            del self._held[owner]

    def _kept(self) -> int:
        """Places that are kept for each owner."""
        count = len(self._owners())
        return max(self.most // (2 * count), 1 if count <= self.most else 0)
