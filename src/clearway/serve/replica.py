"""What a replica of a service has of the others: sessions, figures, and whether one of them is ready."""

from __future__ import annotations

import time
from collections.abc import MutableSequence
from dataclasses import dataclass
from pathlib import Path

from clearway.serve.shared_sessions import SharedSessions

BEAT_S = 0.5  # between two beats
FRESH_S = 3.0  # for which a beat counts


class Beats:
    """When each replica beat last, and whether it was ready then, in memory that all of them share.

    Args:
        shared: two numbers for each replica, zeros at first.
    """

    def __init__(self, shared: MutableSequence[float]) -> None:
        self.shared = shared

    def beat(self, number: int, ready: bool) -> None:
        """A replica tells that it runs, and whether it is ready."""
        self.shared[2 * number + 1] = float(ready)
        self.shared[2 * number] = time.monotonic()

    def forget(self, number: int) -> None:
        """A replica has ended."""
        self.shared[2 * number : 2 * number + 2] = [0.0, 0.0]

    def last_s(self, number: int) -> float:
        """When a replica beat last, on the monotonic clock; 0 where it has not yet."""
        return self.shared[2 * number]

    def any_ready(self) -> bool:
        """Whether a replica has told lately that it is ready."""
        oldest = time.monotonic() - FRESH_S
        told = zip(self.shared[::2], self.shared[1::2], strict=True)
        return any(ready and beaten > oldest for beaten, ready in told)

    def any_fresh(self) -> bool:
        """Whether a replica has beaten lately, ready or not."""
        return max(self.shared[::2]) > time.monotonic() - FRESH_S


@dataclass(frozen=True)
class Replica:
    """One of several.

    Attributes:
        number: from 0; the replica that takes its place has it too.
        sessions: of all.
        beats: of all.
        figures: folder in which all count, see prometheus_client's multiprocess mode.
    """

    number: int
    sessions: SharedSessions
    beats: Beats
    figures: Path
