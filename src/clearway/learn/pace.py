"""How long each worker computes, so that a slow one is found: all others wait for it."""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from clearway.learn.peers import Peers

SLOW = 1.5  # times the median of the workers' computing times
LEAST_S = 1.0  # of computing, which chance decides no more
TOLD_EVERY_S = 60.0


class Pace:
    """Times of this worker's updates, and what they are among all workers'.

    Args:
        peers: the workers.
    """

    def __init__(self, peers: Peers) -> None:
        self.peers = peers
        self.updates, self.computed_s = 0, 0.0
        self.told_at = -TOLD_EVERY_S

    @contextmanager
    def measured(self) -> Iterator[None]:
        """Count an update, without the time of waiting for others."""
        started, waited_s = time.monotonic(), self.peers.waited_s
        yield
        self.computed_s += time.monotonic() - started - (self.peers.waited_s - waited_s)
        self.updates += 1

    def figures(self) -> dict[str, float]:
        """Of the updates since the last call: the slowest worker and how much longer it computed than the median.

        Empty with one worker. A worker much slower than the others is named on standard error, once in a while.
        """
        if self.peers.count == 1:
            return {}
        times = [seconds / max(updates, 1) for updates, seconds in self.peers.told(self.updates, self.computed_s)]
        long, self.updates, self.computed_s = self.computed_s > LEAST_S, 0, 0.0
        slowest = max(range(len(times)), key=times.__getitem__)
        factor = times[slowest] / max(statistics.median_low(times), 1e-9)
        if factor > SLOW and long and slowest == self.peers.rank and time.monotonic() - self.told_at > TOLD_EVERY_S:
            self.told_at = time.monotonic()
            name = f"training: worker {slowest} of {self.peers.count} ({self.peers.name})"
            print(f"{name} is slow: it computes {factor:.1f} times as long as the median", file=sys.stderr, flush=True)
        return {"slowest_worker": slowest, "slowest_factor": float(f"{factor:.3g}")}
