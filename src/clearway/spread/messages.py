"""Objects as messages between processes that started each other, the only place of the package that pickles.

Nothing that was read from a file, or came from elsewhere, may become a message: reading one can run code.
"""

from __future__ import annotations

import gc
import pickle
from collections.abc import Callable
from typing import Any


class Sent:
    """An object on its way to several processes: pickled once, and in the best way, however they are started.

    What arrives is the object itself.
    """

    def __init__(self, content: Any) -> None:
        self._message = to_message(content)

    def __reduce__(self) -> tuple[Callable[[bytes], Any], tuple[bytes]]:
        return from_message, (self._message,)


def to_message(content: Any) -> bytes:
    """An object for a process of ours. Raises what pickle raises where it cannot be sent."""
    return pickle.dumps(content, pickle.HIGHEST_PROTOCOL)


def from_message(message: bytes) -> Any:
    """The object of a message that a process of ours made."""
    searching = gc.isenabled()
    gc.disable()  # there is no garbage yet, and a large message makes so many objects that it is searched for often
    try:
        return pickle.loads(message)
    finally:
        if searching:
            gc.enable()
