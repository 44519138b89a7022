"""What a worker does, a process of this machine or one of Ray's: set up once, then part after part.

A process of this machine reads messages from standard input: first what `packed` makes of the work, then part after
part; it answers each on standard output. A message is its length, 8 bytes, and what `messages` makes of an object; only
processes that started each other exchange them. When standard input ends, its parent is gone, and it ends at once.
"""

from __future__ import annotations

import os
import sys
import threading
import traceback
from collections.abc import Callable
from queue import SimpleQueue
from typing import IO, Any

from clearway.children import collector_rests
from clearway.spread.messages import from_message, to_message

ORPHANED = 1  # exit codes; nobody is left to see this one
INTERRUPTED = 130
LENGTH_BYTES = 8

_set_up: dict[str, tuple[Callable[[Any, Any], Any], Any]] = {}  # by key, one at a time: function and tool


def packed(set_up: Callable[[], Any], do: Callable[[Any, Any], Any]) -> bytes:
    """A work as a message, with the command that it is part of."""
    return to_message((set_up, do, sys.argv))


def done(key: str, work: Callable[[], bytes], part: bytes) -> Any:
    """The result of a part, by the tool that this process has set up.

    Args:
        key: of the work; a process sets up again when it gets another.
        work: gives what `packed` made; asked only to set up.
        part: a message.
    """
    if key not in _set_up:
        _set_up.clear()
        with collector_rests():  # much may have to be imported
            set_up, do, sys.argv = from_message(work())  # what is made here was begun by that command
            _set_up[key] = do, set_up()
    do, tool = _set_up[key]
    return do(tool, from_message(part))


def write_message(stream: IO[bytes], message: bytes) -> None:
    """Write a message; `read_message` reads it."""
    stream.write(len(message).to_bytes(LENGTH_BYTES, "little"))
    stream.write(message)
    stream.flush()


def read_message(stream: IO[bytes]) -> bytes | None:
    """The next message; None where the stream ends before it does."""
    head = stream.read(LENGTH_BYTES)
    length = int.from_bytes(head, "little")
    message = stream.read(length) if len(head) == LENGTH_BYTES else b""
    return message if len(head) == LENGTH_BYTES and len(message) == length else None


def main() -> None:
    """Do what standard input asks for."""
    source, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # what is printed must not mix with the answers
    messages: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_read_all, args=(source, messages), daemon=True).start()
    work = [messages.get()]
    while True:
        part = messages.get()
        try:
            answer = to_message((True, done("", lambda: work[0], part)))
            work.clear()  # it may be large
        except KeyboardInterrupt as error:
            write_message(answers, to_message((False, error)))
            sys.exit(INTERRUPTED)
        except Exception as error:  # whatever it is, the parent raises it
            answer = to_message((False, _sendable(error)))
        write_message(answers, answer)


def _read_all(source: IO[bytes], messages: SimpleQueue[bytes]) -> None:
    """Pass messages on; end the process when there are no more, though it be in the middle of a part."""
    while (message := read_message(source)) is not None:
        messages.put(message)
    os._exit(ORPHANED)


def _sendable(error: Exception) -> Exception:
    """The error with where it was raised, or one with its words where it cannot be sent."""
    told = "".join(traceback.format_exception(error))
    try:
        from_message(to_message(error))
    except Exception:  # whatever its own pickling raises
        return RuntimeError(told)
    error.add_note(f"in a worker:\n{told}")
    return error
