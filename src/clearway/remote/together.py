"""The same task for many files at a time, of which none goes on once one has failed or the user has had enough."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TypeVar

AT_ONCE = 16  # files that are asked about or fetched at a time
One = TypeVar("One")
Result = TypeVar("Result")


def together(
    task: Callable[[One, threading.Event], Result],
    ones: Sequence[One],
    show_done: Callable[[int], None] = lambda done: None,
) -> list[Result]:
    """Results of a task for each of some things, in order; the first failure is raised.

    Args:
        task: is given a thing, and an event: once that is set it ends soon, whatever it raises.
        ones: the things.
        show_done: is told how many are done.
    """
    stop = threading.Event()
    pool = ThreadPoolExecutor(AT_ONCE)
    try:
        waiting = [pool.submit(task, one, stop) for one in ones]
        for done, future in enumerate(as_completed(waiting), 1):
            future.result()
            show_done(done)
        return [future.result() for future in waiting]
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)
