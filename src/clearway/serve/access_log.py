"""A line of JSON for every answer, sampled where there are too many; and no more of uvicorn's lines than are of use."""

from __future__ import annotations

import json
import logging
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime

MOST_A_SECOND = 20
SHOWN_LETTERS = 8  # of a session's id: enough to tell sessions apart, too few to use one


def to_stderr(line: str) -> None:
    """Write a line where logs go."""
    print(line, file=sys.stderr, flush=True)


class Sampled:
    """So many in a second; counts what was left out.

    Args:
        most: in a second.
        clock: seconds, monotonic.
    """

    def __init__(self, most: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._most, self._clock = most, clock
        self._begun_s, self._taken, self._skipped = clock(), 0, 0

    def take(self) -> int | None:
        """How many were left out since the last one that was taken; None: this one is to be left out."""
        now = self._clock()
        if now - self._begun_s >= 1.0:
            self._begun_s, self._taken = now, 0
        if self._taken >= self._most:
            self._skipped += 1
            return None
        self._taken += 1
        skipped, self._skipped = self._skipped, 0
        return skipped


class AccessLog:
    """Lines of JSON: time, address, owner and session where they are known, route, status, seconds, lines left out.

    Args:
        write: takes a line.
        sampled: how many of them.
    """

    def __init__(self, write: Callable[[str], object], sampled: Sampled | None = None) -> None:
        self._write, self._sampled = write, sampled or Sampled(MOST_A_SECOND)

    def note(
        self, address: str, owner: str | None, session: str | None, route: str, status: int, seconds: float
    ) -> None:
        """Write of an answer, unless there are too many."""
        if (skipped := self._sampled.take()) is None:
            return
        said = {
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "address": address,
            "owner": owner,
            "session": session and session[:SHOWN_LETTERS],
            "route": route,
            "status": status,
            "seconds": round(seconds, 4),
            "skipped": skipped,
        }
        self._write(json.dumps(said))


class Sparing(logging.Filter):
    """Lets a line a second through: strangers can cause as many as they like."""

    def __init__(self) -> None:
        super().__init__()
        self._sampled = Sampled(1)

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether it is to be seen; it says how many were not."""
        if (skipped := self._sampled.take()) is None:
            return False
        if skipped:
            record.msg = f"{record.getMessage()} ({skipped} more lines left out)"
            record.args = ()
        return True
