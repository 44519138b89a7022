"""A task in workers whose processes would not end by themselves."""

from __future__ import annotations

import atexit
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from clearway.learn.crew import Task
from clearway.learn.peers import LostPeer, Peers

NEVER_S = 3600.0
ENDS = {"done": None, "interrupted": KeyboardInterrupt, "lost": LostPeer}


@dataclass(frozen=True)
class EndsSlowly(Task):
    """The first time it ends as told, and is done when it is started again."""

    end: str

    def do(self, peers: Peers) -> None:
        """See `Task`."""
        peers.ready()
        atexit.register(time.sleep, NEVER_S)
        if (error := ENDS[self.end]) and os.environ["TORCHELASTIC_RESTART_COUNT"] == "0":
            raise error

    @contextmanager
    def watched(self) -> Iterator[Callable[[], None]]:
        """See `Task`."""
        yield lambda: None
