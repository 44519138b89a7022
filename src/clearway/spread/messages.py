"""Objects as messages between processes that started each other, the only place of the package that pickles.

Nothing that was read from a file, or came from elsewhere, may become a message: reading one can run code.
"""

from __future__ import annotations

import pickle
from typing import Any


def to_message(content: Any) -> bytes:
    """An object for a process of ours. Raises what pickle raises where it cannot be sent."""
    return pickle.dumps(content, pickle.HIGHEST_PROTOCOL)


def from_message(message: bytes) -> Any:
    """The object of a message that a process of ours made."""
    return pickle.loads(message)
