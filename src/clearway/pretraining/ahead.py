"""Things that are made in a thread of their own before they are asked for."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
AHEAD = 2  # of them at a time


def made_ahead(things: Iterator[T], count: int = AHEAD) -> Iterator[T]:
    """The same things in the same order; the next `count` are made meanwhile. What goes wrong there is raised here."""
    with ThreadPoolExecutor(1) as thread:
        waiting: deque[Future[tuple[T, ...]]] = deque()

        def one() -> tuple[T, ...]:
            for thing in things:
                return (thing,)
            return ()

        try:
            while True:
                while len(waiting) <= count:
                    waiting.append(thread.submit(one))
                made = waiting.popleft().result()
                if not made:
                    return
                yield made[0]
        finally:
            for future in waiting:
                future.cancel()
