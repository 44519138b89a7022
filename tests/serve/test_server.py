"""The service as a process of its own, over real connections: slow and hostile clients, many at a time, its end."""

from __future__ import annotations

import asyncio
import signal
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import httpx
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import clearway
from clearway.serve.client import KEEP_ALIVE_S as CLIENT_KEEP_ALIVE_S
from clearway.serve.client import ServiceError
from helpers.running import PATIENT_S, Running, running
from helpers.serving import TOKEN, grey, picture_bytes, until_closed
from helpers.sums import Sums, plain

AUTHORISED = {"authorization": f"Bearer {TOKEN}"}
HEAD = f"Host: x\r\nAuthorization: Bearer {TOKEN}\r\n".encode()


@pytest.fixture(scope="module")
def hasty() -> Iterator[Running]:
    """A service with little patience."""
    with running(patience_s=1.0, deadline_s=3.0, body_bytes=100_000, connections=40) as found:
        yield found


def still_serves(service: Running) -> bool:
    with service.client() as client, client.session(selection="argmax") as session:
        session.set_target(plain(1))
        return session.act(plain(2)).value == 1008


@pytest.mark.slow
def test_headers_that_do_not_come_and_headers_that_trickle(hasty) -> None:
    for begin in (b"", b"GET /health HTTP/1.1\r\n", b"GET /health HTTP/1.1\r\nHost: x\r\n\r\nGET /he"):
        with hasty.connected() as connection:
            begun = time.monotonic()
            connection.sendall(begin)

            def trickle(connection=connection) -> None:
                try:
                    for _ in range(600):
                        time.sleep(0.1)
                        connection.sendall(b"x")
                except OSError:
                    pass

            sender = threading.Thread(target=trickle)
            if begin:
                sender.start()
            answer = until_closed(connection)
            assert time.monotonic() - begun < PATIENT_S
            assert answer.count(b"HTTP/1.1") == begin.count(b"\r\n\r\n")
        if begin:
            sender.join()
    assert still_serves(hasty)


@pytest.mark.slow
def test_an_upload_that_trickles_is_refused_and_one_cut_off_changes_nothing(hasty) -> None:
    with hasty.client() as client, client.session(selection="argmax") as session:
        session.set_target(plain(0))
        assert session.act(plain(1)).value == 4
        path = f"POST /sessions/{session.session_id}/steps HTTP/1.1\r\n".encode()
        content = grey(9)
        said = f"Content-Type: image/png\r\nContent-Length: {len(content)}\r\n\r\n".encode()
        with hasty.connected() as connection:
            connection.sendall(path + HEAD + said + content[:20])
            answer = until_closed(connection)
        assert answer.startswith(b"HTTP/1.1 408 ") and b'"too_slow"' in answer and b"connection: close" in answer
        with hasty.connected() as connection:
            connection.sendall(path + HEAD + said + content[:-1])  # and away
        with hasty.connected() as connection:
            connection.sendall(path + HEAD + b"Content-Type: image/png\r\nContent-Length: 99999999999\r\n\r\n")
            assert until_closed(connection).startswith(b"HTTP/1.1 413 ")
        with hasty.connected() as connection:
            connection.sendall(path + HEAD + b"Content-Type: image/png\r\nTransfer-Encoding: chunked\r\n\r\n")
            part = b"4000\r\n" + bytes(0x4000) + b"\r\n"
            try:
                for _ in range(100):
                    connection.sendall(part)
            except OSError:
                pass  # cut off in the middle, as it should be
            assert until_closed(connection)[:13] in (b"HTTP/1.1 413 ", b"")
        assert session.act(plain(2)).value == 5


@pytest.mark.slow
def test_a_connection_stays_open_for_longer_than_clients_keep_theirs(hasty) -> None:
    """A robot that steps every few seconds would else send pictures while the service closes."""
    with hasty.connected() as connection:
        for pause_s in (CLIENT_KEEP_ALIVE_S + 0.5, 0):
            connection.sendall(b"GET /agent HTTP/1.1\r\n" + HEAD + b"\r\n")
            answer = b""
            while b'"scene":"attic"' not in answer:
                part = connection.recv(65536)
                assert part, "the connection was closed"
                answer += part
            time.sleep(pause_s)


@pytest.mark.slow
def test_a_client_that_does_not_read_is_cut_off(hasty) -> None:
    """One by pipelining requests, one in a stream; neither holds the service up."""
    with hasty.connected() as connection, hasty.client() as client:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(PATIENT_S)
        request = b"GET /openapi.json HTTP/1.1\r\n" + HEAD + b"\r\n"
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            for _ in range(10**6):
                connection.sendall(request)
        session = client.session()
        session.set_target(plain(0))
        address = f"ws://127.0.0.1:{hasty.port}/sessions/{session.session_id}/stream"
        plug = socket.create_connection(("127.0.0.1", hasty.port), timeout=PATIENT_S)
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        with connect(address, additional_headers=AUTHORISED, sock=plug, max_queue=1, close_timeout=0.1) as stream:
            stream.recv_bufsize = 1
            with pytest.raises((ConnectionClosed, OSError)):
                for _ in range(10**6):
                    stream.send(b"no picture: the answer is longer than this")
    assert still_serves(hasty)


def test_connections_are_limited(hasty) -> None:
    held = [hasty.connected() for _ in range(60)]
    try:
        with hasty.connected() as connection:
            connection.sendall(b"GET /health HTTP/1.1\r\n" + HEAD + b"\r\n")
            assert connection.recv(20).startswith(b"HTTP/1.1 503")
    finally:
        for connection in held:
            connection.close()
    deadline = time.monotonic() + PATIENT_S
    while time.monotonic() < deadline:
        if httpx.get(f"{hasty.url}/health", timeout=PATIENT_S).status_code == 200:
            break
    assert still_serves(hasty)


def test_what_is_no_http_and_what_is_no_websocket(hasty) -> None:
    tls, large = b"\x16\x03\x01\x02\x00\x01", b"GET / HTTP/9.9\r\n\r\n" + b"A" * 70_000
    for nonsense in (tls, b"GET\r\n\r\n", b"\0" * 5000, large):
        with hasty.connected() as connection:
            with suppress(OSError):
                connection.sendall(nonsense)
            assert b"Traceback" not in until_closed(connection)
    with hasty.client() as client, client.session() as session:
        address = f"ws://127.0.0.1:{hasty.port}/sessions/{session.session_id}/stream"
        with connect(address, additional_headers=AUTHORISED) as stream, pytest.raises(ConnectionClosed) as closed:
            stream.send(bytes(100_001))
            stream.recv(timeout=PATIENT_S)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009  # message too big
    assert still_serves(hasty)


async def walk(http: httpx.AsyncClient, number: int, until: float, least: int) -> int:
    """One session's episode, every answer held against a navigator's own; how many steps it had."""
    navigator = clearway.Navigator(Sums(), seed=number)
    rng = np.random.default_rng(number)
    answer = await http.post("/sessions", json={"seed": number}, headers={"content-type": "application/json"})
    session = f"/sessions/{answer.json()['session_id']}"
    assert (await http.put(f"{session}/target", content=grey(number % 256))).status_code == 204
    navigator.set_target(plain(number % 256))
    steps = 0
    while steps < least or time.monotonic() < until:
        level = int(rng.integers(256))
        expected, answer = navigator.act(plain(level)), await http.post(f"{session}/steps", content=grey(level))
        steps += 1
        found = answer.json()
        assert answer.status_code == 200, found
        assert (found["value"], found["action_index"], found["step"]) == (expected.value, expected.action, steps)
    assert (await http.delete(session)).status_code == 204
    return steps


def walk_together(service: Running, sessions: int, seconds: float, least: int) -> int:
    async def all_of_them() -> list[int]:
        until, headers = time.monotonic() + seconds, {**AUTHORISED, "content-type": "image/png"}
        room = httpx.Limits(max_connections=sessions)
        async with httpx.AsyncClient(base_url=service.url, headers=headers, timeout=PATIENT_S, limits=room) as http:
            return await asyncio.gather(*(walk(http, number, until, least) for number in range(sessions)))

    steps = asyncio.run(all_of_them())
    figures = httpx.get(f"{service.url}/metrics", headers=AUTHORISED).text
    assert f'clearway_requests_total{{route="/sessions/{{session_id}}/steps",status="200"}} {sum(steps)}.0' in figures
    assert "clearway_sessions 0.0" in figures
    return sum(steps)


def test_concurrent_sessions_are_neither_lost_nor_mixed_up() -> None:
    with running(seconds=0.002) as service:
        assert walk_together(service, sessions=24, seconds=0, least=8) == 24 * 8


@pytest.mark.slow
def test_two_hundred_sessions_for_a_minute() -> None:
    with running(seconds=0.005, deadline_s=60, idle_s=300) as service:
        steps = walk_together(service, sessions=200, seconds=40, least=2)
    print(f"200 sessions: {steps} steps, each as its navigator's")
    assert steps >= 400


@pytest.mark.slow
def test_what_is_under_way_is_answered_before_the_end() -> None:
    with running(seconds=4.0) as service, service.client() as client:
        session = client.session(selection="argmax")
        session.set_target(plain(1))
        found: list[float] = []
        asking = threading.Thread(target=lambda: found.append(session.act(plain(2)).value))
        asking.start()
        time.sleep(2.0)  # it is under way then, on a busy machine, too
        service.process.send_signal(signal.SIGTERM)
        asking.join(PATIENT_S)
        out, err = service.process.communicate(timeout=PATIENT_S)
        assert (found, service.process.returncode, out, err) == ([1008.0], 0, "ended\n", "")
        with pytest.raises(ServiceError, match="unreachable"):
            session.act(plain(3))


@pytest.mark.slow
def test_streams_are_closed_at_the_end() -> None:
    with running() as service, service.client() as client:
        session = client.session()
        address = f"ws://127.0.0.1:{service.port}/sessions/{session.session_id}/stream"
        with connect(address, additional_headers=AUTHORISED) as stream:
            service.process.send_signal(signal.SIGTERM)
            with pytest.raises(ConnectionClosed) as closed:
                stream.recv(timeout=PATIENT_S)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1012  # service restarts
        service.process.communicate(timeout=PATIENT_S)
        assert service.process.returncode == 0


@pytest.mark.slow
def test_a_kill_in_the_middle_is_an_error_that_says_so() -> None:
    with running(seconds=30, deadline_s=50) as service, service.client() as client:
        session = client.session()
        killing = threading.Timer(0.5, service.process.kill)
        killing.start()
        with pytest.raises(ServiceError) as caught:
            session.set_target(plain(1))
        assert caught.value.code == "unreachable"


def test_a_client_that_resets_its_connection_harms_nobody(hasty) -> None:
    for _ in range(20):
        connection = hasty.connected()
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        connection.sendall(b"POST /sessions HTTP/1.1\r\n" + HEAD + b"Content-Length: 50\r\n\r\n{")
        connection.close()
    assert still_serves(hasty)


def test_a_picture_file_as_it_is(hasty, tmp_path) -> None:
    path: Path = tmp_path / "view.jpg"
    path.write_bytes(picture_bytes(plain(8, (12, 16)), "JPEG", quality=95))
    with hasty.client() as client, client.session(selection="argmax") as session:
        session.set_target(path)
        assert session.act(path.read_bytes()).value == pytest.approx(8032, abs=20)
