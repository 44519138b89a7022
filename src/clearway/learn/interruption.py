"""Interruption of a training: what it is doing is finished and saved first."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interruption(*, of_several: bool = False) -> Iterator[threading.Event]:
    """An event that Ctrl+C or SIGTERM sets, so that an update is finished and saved; a second one stops at once.

    Args:
        of_several: workers train together, and a signal may reach each twice, from its parent and with all of the
            process group: a second one changes nothing. What takes too long is ended by who started them.
    """
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def handler(number: int, frame: object) -> None:
        if event.is_set() and not of_several:
            raise KeyboardInterrupt
        event.set()

    for number in before:
        signal.signal(number, handler)
    try:
        yield event
    finally:
        for number, old in before.items():
            signal.signal(number, old)
