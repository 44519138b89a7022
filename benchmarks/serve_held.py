"""What a service holds at its limits: memory with as many connections and partial messages as it takes. Linux.

    python benchmarks/serve_held.py generalist                   # or a file, or a run folder

Strangers at five addresses of this machine each open 400 connections and send 60 kB of headers that do not end. Then
one of three names opens 100 WebSockets and sends all but a byte of the largest message on each.
"""

from __future__ import annotations

import argparse
import asyncio
import socket
import struct
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from urllib.parse import urlsplit

import httpx
from family import family, resident_mib
from serve_attack import ANSWER_S, TOKENS, opened, served_to_robots
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

ADDRESSES, EACH, STREAMS = 5, 400, 100
HEADERS = b"GET /agent HTTP/1.1\r\nX: " + 60_000 * b"x"
MESSAGE_BYTES = 4 << 20


def main(arguments: Sequence[str] | None = None) -> None:
    """Print MiB before, during and after."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("agent", help="a file that clearway export wrote, a run folder, or generalist")
    options = parser.parse_args(arguments)
    with served_to_robots(options.agent) as (url, pid):

        def tell(when: str) -> None:
            time.sleep(1.5)
            print(f"{when}: {sum(map(resident_mib, family(pid))):.0f} MiB", flush=True)

        tell("before")
        with ExitStack() as held:
            print(f"{strangers(url, held)} connections of {ADDRESSES * EACH} are open")
            tell("with headers that do not end")
        tell("after")
        with ExitStack() as held:
            print(f"{partial(url, held)} partial messages of {STREAMS} are held")
            tell("with partial messages")
        tell("after")


def strangers(url: str, held: ExitStack) -> int:
    """Open connections; how many stay open."""
    to = ("127.0.0.1", urlsplit(url).port or 0)
    plugs = []
    for number in range(ADDRESSES * EACH):
        plug = socket.create_connection(to, source_address=(f"127.0.0.{2 + number % ADDRESSES}", 0))
        plugs.append(held.enter_context(plug))
        with suppress(ConnectionError):
            plug.sendall(HEADERS)
    return sum(map(is_open, plugs))


def is_open(plug: socket.socket) -> bool:
    """Nothing has come, and the other side has not closed."""
    plug.setblocking(False)
    try:
        plug.recv(1)
    except BlockingIOError:
        return True
    except ConnectionError:
        pass
    return False


def partial(url: str, held: ExitStack) -> int:
    """Send all but a byte of messages; how many are held."""

    async def session() -> str:
        async with httpx.AsyncClient(base_url=url, timeout=ANSWER_S) as http:
            return await opened(http, TOKENS["stranger"], None)

    address = f"{url.replace('http', 'ws', 1)}{asyncio.run(session())}/stream"
    bearing = {"authorization": f"Bearer {TOKENS['stranger']}"}
    streams = [
        held.enter_context(connect(address, additional_headers=bearing, close_timeout=0.1)) for _ in range(STREAMS)
    ]
    for stream in streams:
        with suppress(OSError):
            stream.socket.sendall(struct.pack("!BBQI", 0x82, 0x80 | 127, MESSAGE_BYTES, 0) + bytes(MESSAGE_BYTES - 1))
    return sum(map(is_waiting, streams))


def is_waiting(stream: ClientConnection) -> bool:
    """The other side has not closed it."""
    try:
        stream.recv(timeout=0.02)
    except TimeoutError:
        return True
    except ConnectionClosed:
        pass
    return False


if __name__ == "__main__":
    main()
