"""Things that are made in threads of their own before they are asked for."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
U = TypeVar("U")
AHEAD = 2  # of them, beside one for each thread


def made_ahead(parts: Iterator[T], make: Callable[[T], U], threads: int = 1) -> Iterator[U]:
    """What `make` makes of each part, in their order; what goes wrong there is raised here.

    Args:
        parts: read one after the other, in a thread of their own.
        make: called by several threads at once.
        threads: that make things meanwhile.
    """
    with ThreadPoolExecutor(1) as reader, ThreadPoolExecutor(threads) as makers:
        read: deque[Future[tuple[T, ...]]] = deque()
        waiting: deque[Future[tuple[U, ...]]] = deque()

        def part() -> tuple[T, ...]:
            for one in parts:
                return (one,)
            return ()

        def made(reading: Future[tuple[T, ...]]) -> tuple[U, ...]:
            return tuple(make(one) for one in reading.result())

        try:
            while True:
                while len(waiting) < AHEAD + threads:
                    read.append(reader.submit(part))
                    waiting.append(makers.submit(made, read[-1]))
                thing = waiting.popleft().result()
                read.popleft()
                if not thing:
                    return
                yield thing[0]
        finally:
            for making in waiting:
                making.cancel()
            for reading in read:
                reading.cancel()
