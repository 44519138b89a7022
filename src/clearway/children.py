"""Child processes that do not hear what the terminal sends to the whole group: their parent ends them, or its death."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

ORPHANED = 1  # exit code; nobody is left to see it


def end_with_parent() -> None:
    """Let this process, a child of `multiprocessing`, end at once when its parent is gone, however that came.

    Without it a child goes on after its parent got SIGKILL, and keeps its files locked. It saves nothing before it
    ends, so what it writes must be fit for that.
    """
    parent = multiprocessing.parent_process()
    assert parent is not None, "this process is nobody's child"

    def wait() -> None:
        parent.join()
        os._exit(ORPHANED)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def signals_held(*numbers: signal.Signals) -> Iterator[None]:
    """Signals wait here meanwhile, and processes started meanwhile never get them. No effect on Windows."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the first process would start it, and starting it lets the signals through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
