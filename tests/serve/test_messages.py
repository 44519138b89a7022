"""What is held of WebSocket messages that are not whole, or not answered yet."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import Mock

import pytest
import uvicorn
from uvicorn.protocols.utils import ClientDisconnected
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from clearway.serve.admitted import Admitted
from clearway.serve.connections import Strangers
from clearway.serve.handshakes import Handshakes
from clearway.serve.limits import Limits
from clearway.serve.messages import MOST_FRAGMENTS, ImpatientSocket, impatient
from clearway.serve.shares import Places
from clearway.serve.tokens import KNOWN
from helpers.running import PATIENT_S, Running, running
from helpers.serving import OWNER, TOKEN, TOKENS, grey

BINARY, CONTINUED, LAST = 0x02, 0x00, 0x80


@contextmanager
def streaming(service: Running) -> Iterator[ClientConnection]:
    with service.client() as client, client.session() as session:
        address = f"ws://127.0.0.1:{service.port}/sessions/{session.session_id}/stream"
        with connect(address, additional_headers={"authorization": f"Bearer {TOKEN}"}, close_timeout=0.1) as stream:
            yield stream


def begun(kind: int, content: bytes, length: int | None = None) -> bytes:
    """A masked frame, or the begin of a longer one."""
    return struct.pack("!BBHI", kind, 0x80 | 126, length or len(content), 0) + content


def close_code(stream: ClientConnection) -> int:
    with pytest.raises(ConnectionClosed) as closed:
        stream.recv(timeout=PATIENT_S)
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


@pytest.mark.slow
def test_what_is_held_of_partial_messages_together_is_bounded() -> None:
    """Each could once hold as much as one message may have."""
    with running(body_bytes=60_000, bodies_bytes=100_000) as service:
        with streaming(service) as first, streaming(service) as second, streaming(service) as third:
            picture = grey(1)
            first.socket.sendall(begun(LAST | BINARY, picture, 60_000) + bytes(40_000))
            second.send(picture)
            assert json.loads(second.recv(timeout=PATIENT_S))["error"]["code"] == "no_target"
            third.socket.sendall(begun(BINARY, bytes(59_999), 60_000))
            assert close_code(third) == 1013
            first.socket.sendall(bytes(20_000 - len(picture)))
            assert json.loads(first.recv(timeout=PATIENT_S))["error"]["code"] == "no_target"
            second.socket.sendall(begun(LAST | BINARY, bytes(59_999), 60_000) + b"x")  # there is room again
            assert json.loads(second.recv(timeout=PATIENT_S))["error"]["code"] == "no_target"


@pytest.mark.slow
def test_a_message_that_trickles_is_given_up() -> None:
    with running(deadline_s=0.5) as service, streaming(service) as stream:
        stream.socket.sendall(begun(BINARY, b"x", 1000))
        assert close_code(stream) == 1008


def test_a_message_in_too_many_parts_is_given_up() -> None:
    with running() as service, streaming(service) as stream:
        stream.socket.sendall(begun(BINARY, b"") + begun(CONTINUED, b"") * (MOST_FRAGMENTS + 1))
        assert close_code(stream) == 1009


def asked_for(app, places: Places) -> tuple[ImpatientSocket, Mock]:
    """A connection that asks for a stream, and what it writes to."""
    config = uvicorn.Config(app)
    config.load()
    kind = impatient(Limits(), places, places, Admitted(TOKENS), Strangers(1, None), Handshakes(1, 1.0, None))[1]
    connection = kind(config, uvicorn.server.ServerState(), {})
    transport = Mock(get_extra_info=lambda name, default=None: None, is_closing=lambda: False)
    connection.connection_made(transport)
    lines = ("GET / HTTP/1.1", "Host: x", "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13")
    connection.data_received("\r\n".join((*lines, f"Sec-WebSocket-Key: {22 * 'A'}==", "", "")).encode())
    return connection, transport


def test_nothing_is_read_before_the_token_was_right_and_all_is_given_back_at_the_end() -> None:
    async def asked() -> tuple[list[str], int, int]:
        known = asyncio.Event()

        async def app(scope, receive, send) -> None:
            await known.wait()
            scope["state"][KNOWN](OWNER, TOKEN)
            await receive()
            await send({"type": "websocket.accept"})
            await asyncio.Event().wait()

        places = Places(1000, lambda: {OWNER})
        connection, transport = asked_for(app, places)
        await asyncio.sleep(0.01)
        before = [name for name, *_ in transport.method_calls if "reading" in name]
        known.set()
        await asyncio.sleep(0.01)
        connection.data_received(begun(BINARY, bytes(100), 500))
        during = places.taken
        connection.connection_lost(None)
        return before, during, places.taken

    before, during, after = asyncio.run(asked())
    assert (before, after) == (["pause_reading"], 0) and during >= 100


def test_an_answer_to_a_stream_that_was_given_up_says_that_nobody_is_there() -> None:
    """Over TLS a connection can be there for some time yet."""

    async def asked() -> bytes:
        async def app(scope, receive, send) -> None:
            scope["state"][KNOWN](OWNER, TOKEN)
            await receive()
            await send({"type": "websocket.accept"})
            await asyncio.Event().wait()

        connection, transport = asked_for(app, Places(1000, lambda: {OWNER}))
        await asyncio.sleep(0.01)
        connection.revoke()
        with pytest.raises(ClientDisconnected):
            await connection.send({"type": "websocket.send", "text": "an answer"})
        return transport.write.call_args.args[0]

    assert asyncio.run(asked())[2:4] == struct.pack("!H", 1008)
