"""A decoder process: picture files in by its standard input, a socket; pixels or a refusal out by the same.

A question is `ASKED` (bytes of the file, milliseconds of processor time) and the file; a picture that takes longer ends
the process. An answer is `PIXELS` (height, width, 0) and RGB bytes, or `REFUSED` (bytes, 0, 0) and JSON: code, message.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import sys
import warnings

from PIL import Image

from clearway.children import limit
from clearway.serve.decoding import Bounds, Refused, decoded

ASKED, ANSWER = struct.Struct("<II"), struct.Struct("<BII")
PIXELS, REFUSED = 0, 1
BUFFER_BYTES = 1 << 20  # of the system for each direction


def main() -> None:
    """Answer until the other side closes. The argument is JSON: bounds, memory_bytes, nice."""
    job = json.loads(sys.argv[1])
    os.nice(job["nice"])
    Image.preinit()
    warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # `decoding` refuses by a limit of our own
    limit(memory_bytes=job["memory_bytes"])
    bounds = Bounds(**job["bounds"])
    with socket.socket(fileno=0) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        while head := _received(connection, ASKED.size):
            length, milliseconds = ASKED.unpack(head)
            content = _received(connection, length)
            signal.setitimer(signal.ITIMER_PROF, milliseconds / 1000)  # SIGPROF ends the process, whatever it does
            answer = _answer(content, bounds)
            signal.setitimer(signal.ITIMER_PROF, 0)
            connection.sendall(answer)


def _answer(content: bytes, bounds: Bounds) -> bytes:
    try:
        picture = decoded(content, bounds)
    except Refused as refusal:
        told = json.dumps([refusal.code, refusal.message]).encode()
        return ANSWER.pack(REFUSED, len(told), 0) + told
    return ANSWER.pack(PIXELS, picture.height, picture.width) + picture.tobytes()


def _received(connection: socket.socket, length: int) -> bytes:
    """So many bytes; none where the other side has closed."""
    found = bytearray(length)
    view, have = memoryview(found), 0
    while have < length:
        if not (more := connection.recv_into(view[have:])):
            return b""
        have += more
    return bytes(found)


if __name__ == "__main__":
    main()
