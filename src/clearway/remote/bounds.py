"""Downloads that end where a server sends more than it said, or hardly anything."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from typing import Any

import fsspec

SLOW_S, LEAST_BYTES_S = 30, 1_000  # a download that is slower for so long is given up


class OtherThanSaid(OSError):
    """A download that brings more than was said, or hardly anything."""


class Bounds(fsspec.Callback):
    """Ends a download once more has come than there is, or hardly anything for a while."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self._most = size
        self.set_size(size)

    def set_size(self, size: int | None) -> None:
        """A download begins, perhaps anew."""
        self._left, self._since, self._came = self._most, time.monotonic(), 0

    def relative_update(self, inc: int = 1) -> None:
        """So many bytes came. Raises OtherThanSaid."""
        self._left -= inc
        self._came += inc
        if self._left < 0:
            raise OtherThanSaid("more bytes come than its server says that it has")
        if time.monotonic() - self._since > SLOW_S:
            if self._came < SLOW_S * LEAST_BYTES_S:
                raise OtherThanSaid(f"fewer than {LEAST_BYTES_S:,} bytes a second came for {SLOW_S} s")
            self._since, self._came = time.monotonic(), 0


def bounded(system: Any, size: int) -> Callable[..., Coroutine[Any, Any, None]]:
    """The download of a file of so many bytes, in `Bounds`."""

    async def get(address: str, path: str, **options: Any) -> None:
        await system._get_file(address, path, callback=Bounds(size), **options)

    return get
