"""Servers of files on this machine: an object store, a web server, Google's interface, and some that fail."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Barrier, BrokenBarrierError, Thread
from time import sleep
from urllib.parse import unquote, urlsplit
from urllib.request import Request, urlopen

import pytest


@pytest.fixture(scope="session")
def object_store() -> Iterator[str]:
    """A server with S3's interface; yields its address."""
    import logging

    from moto.server import ThreadedMotoServer

    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    yield f"http://{host}:{port}"
    server.stop()


@pytest.fixture
def s3(object_store: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[[str, bytes], None]]:
    """An object store with the empty bucket "rooms", and an empty cache; yields what puts a file there by its key."""
    from s3fs import S3FileSystem

    environment = {
        "CLEARWAY_CACHE": str(tmp_path / "cache"),
        "AWS_ENDPOINT_URL": object_store,
        "AWS_ACCESS_KEY_ID": "any",
        "AWS_SECRET_ACCESS_KEY": "any",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_EC2_METADATA_DISABLED": "true",
    }
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    urlopen(Request(f"{object_store}/moto-api/reset", method="POST")).close()
    S3FileSystem.clear_instance_cache()
    system = S3FileSystem()
    system.mkdir("rooms")

    def put(key: str, content: bytes) -> None:
        system.pipe_file(f"rooms/{key}", content)

    yield put
    S3FileSystem.clear_instance_cache()


@contextmanager
def web_server(handler: Callable[..., BaseHTTPRequestHandler]) -> Iterator[str]:
    """A web server; yields its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


class _Files(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


class Dateless(_Files):
    """Does not say when a file was changed."""

    def send_header(self, keyword: str, value: str) -> None:
        if keyword != "Last-Modified":
            super().send_header(keyword, value)


def files_of(folder: Path, kind: type[_Files] = _Files) -> Callable[..., BaseHTTPRequestHandler]:
    """Python's own server of a folder's files, or one that differs from it."""
    return partial(kind, directory=str(folder))


class Unwilling(_Files):
    """Answers every request for a file with the status that its name says, and tells the size of none."""

    def do_HEAD(self) -> None:
        self.send_response(int(Path(urlsplit(self.path).path).stem))
        self.end_headers()

    do_GET = do_HEAD


class CutShort(_Files):
    """Says that a file has ten bytes, and sends four."""

    def do_HEAD(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "10")
        self.end_headers()

    def do_GET(self) -> None:
        self.do_HEAD()
        self.wfile.write(b"four")
        self.close_connection = True


class Shrunk(CutShort):
    """Says that a file has ten bytes, and sends another one, of four."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "4")
        self.end_headers()
        self.wfile.write(b"four")


class Endless(CutShort):
    """Says that a file has ten bytes, and sends them without end; of a folder likewise."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        with suppress(OSError):  # who asked has gone
            while True:
                self.wfile.write(b"<a href=a.h5>" * 1000)


class Trickling(CutShort):
    """Sends slow.h5 byte by byte, 6 s long, after it has told so, and cuts others short."""

    on_first_byte: Callable[[], None] = staticmethod(lambda: None)

    def do_GET(self) -> None:
        if not self.path.endswith("slow.h5"):
            super().do_GET()
            return
        self.do_HEAD()
        for number in range(10):
            with suppress(OSError):  # who asked has gone
                self.wfile.write(b"s")
            if number == 0:
                type(self).on_first_byte()
            sleep(0.6)


class Failing(_Files):
    """Fails requests of some methods in its own ways, one after the other, then serves files."""

    methods: tuple[str, ...] = ("GET", "HEAD")
    failures: list[int | str]  # statuses, "cut off" or "silent"
    asked: list[str]  # methods of all requests

    def do_GET(self) -> None:
        self.asked.append(self.command)
        if self.command not in self.methods or not self.failures:
            super().do_GET() if self.command == "GET" else super().do_HEAD()
            return
        failure = self.failures.pop(0)
        if isinstance(failure, int):
            content = b"<Error><Code>SlowDown</Code><Message>Reduce your request rate</Message></Error>"
            self.send_response(failure)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content if self.command == "GET" else b"")
            return
        if failure == "silent":
            sleep(0.4)
        self.close_connection = True

    do_HEAD = do_GET


class Meeting(_Files):
    """Answers the first questions about files once as many are asked as `expected` waits for."""

    expected: Barrier
    left: int

    def do_HEAD(self) -> None:
        if type(self).left:
            type(self).left -= 1
            with suppress(BrokenBarrierError):
                self.expected.wait()
        super().do_HEAD()


class GoogleStore(_Files):
    """The part of Google's JSON interface that lists and reads the objects of one bucket."""

    objects: dict[str, bytes]
    cuts = 0  # how many downloads break off in their midst

    def do_GET(self) -> None:
        path = urlsplit(self.path).path
        name = unquote(path.partition("/b/rooms/o")[2].lstrip("/"))
        if path.startswith("/download") and type(self).cuts:
            type(self).cuts -= 1
            self._send(self.objects[name], "application/octet-stream", sent=len(self.objects[name]) * 2 // 3)
            self.close_connection = True
        elif path.startswith("/download"):
            self._send(self.objects[name], "application/octet-stream")
        elif name in self.objects:
            self._send(json.dumps(self._described(name)).encode())
        elif not name and "/b/rooms" in path:
            self._send(json.dumps({"items": [self._described(one) for one in self.objects]}).encode())
        else:
            self.send_error(404)

    def _described(self, name: str) -> dict[str, str]:
        size = str(len(self.objects[name]))
        return {"name": name, "bucket": "rooms", "size": size, "generation": "1", "etag": "a"}

    def _send(self, content: bytes, kind: str = "application/json", sent: int | None = None) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content[:sent])


@contextmanager
def silent_server() -> Iterator[str]:
    """A server that takes connections and says nothing; yields its address."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
