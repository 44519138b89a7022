"""The way to files elsewhere, by fsspec: which there are, and what goes wrong as one line.

What fails for the moment is tried up to `TRIES` times, with Google's up to six times; then it is given up.
Credentials are those of the machine, as AWS's and Google's own tools read them.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any
from urllib.parse import urljoin

import fsspec

from clearway.errors import ClearwayError, install_hint
from clearway.remote.address import EXTRAS, file_name, without_secrets
from clearway.remote.bounds import bounded
from clearway.remote.faults import faults_named, is_for_the_moment
from clearway.remote.web_folder import files_of_page

CONNECT_S = 10  # for a connection
SILENCE_S = 20  # for the next bytes
ANSWER_S = 60  # for a question about one file or folder, tries together
TRIES = 3
PAUSE_S = 0.5  # before the second try; twice as long before the next one
LOOK_S = 0.1  # how often is looked whether a task is to stop
MAX_NAME_BYTES = 200
MAX_BYTES = 10**18
STOPPING_S = 1  # that a task is given to end
NEVER = threading.Event()  # stops nothing
WRITABLE = ("s3", "gs")
_VERSIONS = ("ETag", "etag", "generation", "Content-MD5", "LastModified", "Last-Modified", "mtime", "updated")


@dataclass(frozen=True)
class RemoteFile:
    """A file elsewhere as it is now.

    Attributes:
        address: of it.
        size: bytes.
        version: another one once the file is another one, as far as its server says.

    Raises:
        ClearwayError: no file of this machine can have such a name or size.
    """

    address: str
    size: int
    version: str

    def __post_init__(self) -> None:
        if not 0 <= self.size <= MAX_BYTES:
            problem = f"its server says that it has {self.size:,} bytes"
            raise ClearwayError(f"{without_secrets(self.address)}: {problem}. Download it by hand")
        if len(self.name.encode()) > MAX_NAME_BYTES or not self.name.isprintable() or "\\" in self.name:
            problem = f"its name has over {MAX_NAME_BYTES} bytes, or letters that no file here may have"
            raise ClearwayError(f"{without_secrets(self.address):.200}: {problem}. Rename it there")

    @property
    def name(self) -> str:
        """The last part of the address."""
        return file_name(self.address)


class Store:
    """The server that an address names.

    Args:
        address: of anything there.

    Raises:
        ClearwayError: the package that speaks with it is not installed, or the address is none.
    """

    def __init__(self, address: str) -> None:
        self.scheme = address.partition(":")[0]
        with faults_named(address):
            try:
                self.system = fsspec.filesystem(self.scheme, **_options(self.scheme))
            except ImportError as error:
                extra = EXTRAS[self.scheme]
                told = f"{without_secrets(address)}: {self.scheme}:// needs another package"
                raise ClearwayError(f"{told}. {install_hint(extra)}") from error
        self._in_one_stream: dict[str, Any] = {}
        if self.scheme == "s3":
            self.system.retries = 1  # `_tried` tries again
            self._in_one_stream = {"max_concurrency": 1}  # else ten parts of 50 MB of each large file are in memory
        self.tries = 1 if self.scheme == "gs" else TRIES  # Google's package tries again by itself

    def listed(self, address: str, suffixes: Sequence[str], stop: threading.Event = NEVER) -> list[dict[str, Any]]:
        """What `described` tells more of: what the address names if it ends like a file, else the folder's, by name.

        Raises:
            ClearwayError: there is none, or the server cannot be asked.
        """
        if file_name(address).endswith(tuple(suffixes)):
            return [{"name": address}]
        with faults_named(address):
            path = self.system._strip_protocol(address)
            folder = path.rstrip("/") + ("/" if self.scheme.startswith("http") else "")
            if self.scheme.startswith("http"):
                listed = self._ask(partial(files_of_page, self.system), folder, stop)
            else:
                listed = self._ask(self.system._ls, folder, stop, detail=True)
        found = [entry for entry in listed if file_name(entry["name"]).endswith(tuple(suffixes))]
        if not found:
            told = f"no file ending in {' or '.join(suffixes)} there"
            raise ClearwayError(f"{without_secrets(address)}: {told}. Check the address")
        return sorted(found, key=lambda entry: file_name(entry["name"]))

    def described(self, entry: dict[str, Any], stop: threading.Event = NEVER) -> RemoteFile:
        """A file of `listed`; it is asked for where the listing did not tell its size. Raises as `file`."""
        name = entry["name"]
        address = name if "://" in name else f"{self.scheme}://{name}"
        if entry.get("size") is None:
            return self.file(address, stop)
        return RemoteFile(address, int(entry["size"]), _version(entry))

    def file(self, address: str, stop: threading.Event = NEVER) -> RemoteFile:
        """A file as it is now. Raises ClearwayError where it is not there, or its server cannot be asked."""
        with faults_named(address):
            entry = self._ask(self.system._info, self.system._strip_protocol(address), stop)
        if entry["type"] == "directory":
            raise ClearwayError(f"{without_secrets(address)}: a folder, expected a file. Check the address")
        if entry.get("size") is None:
            problem = "its server does not say how large it is"
            raise ClearwayError(f"{without_secrets(address)}: {problem}. Download it by hand")
        return RemoteFile(address, int(entry["size"]), _version(entry))

    def download(self, file: RemoteFile, path: Path, stop: threading.Event = NEVER) -> None:
        """Write a file to `path`, not checked further than by its size; given up soon after `stop` is set.

        No more is written than the server has said that there is.

        Raises:
            ClearwayError: it cannot be had whole.
        """
        with faults_named(file.address):
            there = self.system._strip_protocol(file.address)
            self._tried(bounded(self.system, file.size), there, str(path), stop=stop, **self._in_one_stream)
        if (size := path.stat().st_size) != file.size:
            problem = f"{size:,} of {file.size:,} bytes came"
            raise ClearwayError(f"{without_secrets(file.address)}: {problem}. Try again; the file there may be damaged")

    def names(self, address: str) -> list[str]:
        """Names of what lies in a folder, ascending; none where there is no such folder.

        Raises:
            ClearwayError: the server cannot be asked.
        """
        with faults_named(address):
            path = self.system._strip_protocol(address)
            try:
                listed = self._ask(self.system._ls, path, NEVER, detail=True)
            except FileNotFoundError:
                return []
        return sorted(file_name(entry["name"].rstrip("/")) for entry in listed)

    def upload(self, path: Path, address: str) -> None:
        """Put a file of this machine there, in place of what may be there.

        Raises:
            ClearwayError: the server cannot be written to.
        """
        with faults_named(address):
            self._tried(self.system._put_file, str(path), self.system._strip_protocol(address))

    def remove(self, address: str) -> None:
        """Remove a file, if it is there. Raises ClearwayError as `upload` does."""
        with faults_named(address), suppress(FileNotFoundError):
            self._tried(self.system._rm_file, self.system._strip_protocol(address))

    def _ask(self, question: Callable[..., Any], path: str, stop: threading.Event, **options: Any) -> Any:
        return self._tried(question, path, stop=stop, limit_s=ANSWER_S, **options)

    def _tried(
        self,
        task: Callable[..., Coroutine[Any, Any, Any]],
        *given: str,
        stop: threading.Event = NEVER,
        limit_s: float | None = None,
        **options: Any,
    ) -> Any:
        """Result of one of fsspec's tasks, begun anew where it fails for the moment."""

        async def tries() -> Any:
            for before in range(self.tries):
                try:
                    return await task(*given, **options)
                except Exception as fault:
                    if before + 1 == self.tries or not is_for_the_moment(fault):
                        raise
                await asyncio.sleep(PAUSE_S * 2**before)

        return _result(tries(), self.system.loop, stop, limit_s)


def _result(
    task: Coroutine[Any, Any, Any], loop: asyncio.AbstractEventLoop, stop: threading.Event, limit_s: float | None
) -> Any:
    """Result of a task that another thread's loop runs.

    Raises:
        ClearwayError: `stop` was set; the task has ended, too.
        TimeoutError: it took longer than the limit, likewise.
    """
    ended = threading.Event()

    async def until_ended() -> Any:
        try:
            return await task
        finally:
            ended.set()

    began, future = time.monotonic(), asyncio.run_coroutine_threadsafe(until_ended(), loop)
    try:
        while not ended.wait(LOOK_S):
            if stop.is_set():
                raise ClearwayError("stopped")
            if limit_s is not None and time.monotonic() - began > limit_s:
                raise TimeoutError
    except BaseException:
        future.cancel()
        ended.wait(STOPPING_S)
        raise
    return future.result()


def _version(entry: dict[str, Any]) -> str:
    """What tells one content of a file from another, the same of a listing and of the file alone; else nothing.

    The best there is, alone: some stores list milliseconds, and tell seconds of a file.
    """
    return next((str(entry[name]) for name in _VERSIONS if entry.get(name)), "")


def _options(scheme: str) -> dict[str, Any]:
    """What fsspec is told about a scheme, so that nothing waits for ever and listings are fresh."""
    fresh = {"use_listings_cache": False}
    if scheme == "s3":
        patience = {"connect_timeout": CONNECT_S, "read_timeout": SILENCE_S, "retries": {"max_attempts": 0}}
        return {**fresh, "config_kwargs": patience}
    import aiohttp

    logging.getLogger("gcsfs").setLevel(logging.CRITICAL)  # it writes a traceback of every try; we say it in one line
    timeout = aiohttp.ClientTimeout(total=None, sock_connect=CONNECT_S, sock_read=SILENCE_S)
    session = {"timeout": timeout, "trace_configs": [_kept_private()]}
    return {**fresh, ("session_kwargs" if scheme == "gs" else "client_kwargs"): session}


@cache
def _kept_private() -> Any:
    """Has aiohttp follow no redirection from https to http. The same object each time: fsspec compares by it."""
    import aiohttp

    async def look(session: object, context: object, redirected: Any) -> None:
        headers = redirected.response.headers
        there = urljoin(str(redirected.url), headers.get("Location") or headers.get("URI", ""))  # as aiohttp does
        if redirected.url.scheme == "https" and not there.startswith("https:"):
            raise OSError("its server leads from https to http, which is not followed")

    config = aiohttp.TraceConfig()
    config.on_request_redirect.append(look)
    return config
