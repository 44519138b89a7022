"""A task at which one worker fails while the other waits for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from clearway.errors import RunError
from clearway.learn.crew import Task
from clearway.learn.peers import Peers

WORDS = "its scene is damaged. Make it again"


@dataclass(frozen=True)
class OneFails(Task):
    """The last worker meets an error of its own before it tells the others anything."""

    def do(self, peers: Peers) -> None:
        """See `Task`."""
        if not peers.leads:
            raise RunError(WORDS)
        peers.told(1.0)

    @contextmanager
    def watched(self) -> Iterator[Callable[[], None]]:
        """See `Task`."""
        yield lambda: None
