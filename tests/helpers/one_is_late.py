"""A task whose first worker takes longer to read, or to answer, than others wait for an answer."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta

from clearway.errors import RunError
from clearway.learn import crew
from clearway.learn.crew import Task
from clearway.learn.peers import LostPeer, Peers

PATIENCE_S = 8.0
MOST_RESTARTS = 10  # a busy machine may take longer to start one
LOST = "the first is lost"


@dataclass(frozen=True)
class OneIsLate(Task):
    """It ends with `LOST` where the others have waited in vain."""

    reads_s: float
    thinks_s: float

    def __setstate__(self, state: dict[str, object]) -> None:
        crew.PATIENCE = timedelta(seconds=PATIENCE_S)  # in the worker, which has just got its task
        self.__dict__.update(state)

    def do(self, peers: Peers) -> None:
        """See `Task`."""
        if int(os.environ["TORCHELASTIC_RESTART_COUNT"]) > MOST_RESTARTS:
            raise RunError("all were started again and again")
        time.sleep(self.reads_s if peers.leads else 0)
        peers.ready()
        time.sleep(self.thinks_s if peers.leads else 0)
        try:
            peers.told(1.0)
        except LostPeer as error:
            raise RunError(LOST) from error

    @contextmanager
    def watched(self) -> Iterator[Callable[[], None]]:
        """See `Task`."""
        yield lambda: None
