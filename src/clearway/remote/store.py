"""The way to files elsewhere, by fsspec: which there are, and what goes wrong as one line.

A server that sends nothing for `SILENCE_S` is asked once more, Google's up to six times; then it is given up.
Credentials are those of the machine, as AWS's and Google's own tools read them.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fsspec

from clearway.errors import ClearwayError
from clearway.remote.address import EXTRAS, addresses_without_secrets, file_name, without_secrets

CONNECT_S = 10  # for a connection
SILENCE_S = 20  # for the next bytes
ANSWER_S = 60  # for a question about one file or folder, tries together
TRIES = 2
WRITABLE = ("s3", "gs")
_VERSIONS = ("ETag", "etag", "generation", "Content-MD5", "LastModified", "Last-Modified", "mtime", "updated")
_CREDENTIALS = ("Credential", "Permission", "Refresh", "Profile", "Token", "Forbidden")  # in names of errors


@dataclass(frozen=True)
class RemoteFile:
    """A file elsewhere as it is now.

    Attributes:
        address: of it.
        size: bytes.
        version: another one once the file is another one, as far as its server says.
    """

    address: str
    size: int
    version: str

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
        with _faults_named(address):
            try:
                self.system = fsspec.filesystem(self.scheme, **_options(self.scheme))
            except ImportError as error:
                extra = EXTRAS[self.scheme]
                told = f"{without_secrets(address)}: {self.scheme}:// needs another package"
                raise ClearwayError(f"{told}. Install it: pip install 'clearway[{extra}]'") from error
        if hasattr(self.system, "retries"):
            self.system.retries = TRIES

    def files(self, address: str, suffixes: Sequence[str]) -> list[RemoteFile]:
        """The files that an address names: itself if it ends like one, else those of the folder, by name.

        Raises:
            ClearwayError: there is none, or the server cannot be asked.
        """
        if file_name(address).endswith(tuple(suffixes)):
            return [self.file(address)]
        with _faults_named(address):
            path = self.system._strip_protocol(address)
            folder = path.rstrip("/") + ("/" if self.scheme.startswith("http") else "")
            listed = self._ask(self.system._ls, folder, detail=True)
        found = [entry for entry in listed if file_name(entry["name"]).endswith(tuple(suffixes))]
        if not found:
            told = f"no file ending in {' or '.join(suffixes)} there"
            raise ClearwayError(f"{without_secrets(address)}: {told}. Check the address")
        return sorted((self._described(entry) for entry in found), key=lambda file: file.name)

    def file(self, address: str) -> RemoteFile:
        """A file as it is now. Raises ClearwayError where it is not there, or its server cannot be asked."""
        with _faults_named(address):
            entry = self._ask(self.system._info, self.system._strip_protocol(address))
        if entry["type"] == "directory":
            raise ClearwayError(f"{without_secrets(address)}: a folder, expected a file. Check the address")
        if entry.get("size") is None:
            problem = "its server does not say how large it is"
            raise ClearwayError(f"{without_secrets(address)}: {problem}. Download it by hand")
        return RemoteFile(address, int(entry["size"]), _version(entry))

    def download(self, file: RemoteFile, path: Path) -> None:
        """Write a file to `path`, not checked further than by its size.

        Raises:
            ClearwayError: it cannot be had whole.
        """
        with _faults_named(file.address):
            self.system.get_file(self.system._strip_protocol(file.address), str(path))
        if (size := path.stat().st_size) != file.size:
            problem = f"{size:,} of {file.size:,} bytes came"
            raise ClearwayError(f"{without_secrets(file.address)}: {problem}. Try again; the file there may be damaged")

    def names(self, address: str) -> list[str]:
        """Names of what lies in a folder, ascending; none where there is no such folder.

        Raises:
            ClearwayError: the server cannot be asked.
        """
        with _faults_named(address):
            path = self.system._strip_protocol(address)
            try:
                listed = self._ask(self.system._ls, path, detail=True)
            except FileNotFoundError:
                return []
        return sorted(file_name(entry["name"].rstrip("/")) for entry in listed)

    def upload(self, path: Path, address: str) -> None:
        """Put a file of this machine there, in place of what may be there.

        Raises:
            ClearwayError: the server cannot be written to.
        """
        with _faults_named(address):
            self.system.put_file(str(path), self.system._strip_protocol(address))

    def remove(self, address: str) -> None:
        """Remove a file, if it is there. Raises ClearwayError as `upload` does."""
        with _faults_named(address), suppress(FileNotFoundError):
            self.system.rm_file(self.system._strip_protocol(address))

    def _described(self, entry: dict[str, Any]) -> RemoteFile:
        """A file of a listing; web servers list names alone."""
        name = entry["name"]
        address = name if "://" in name else f"{self.scheme}://{name}"
        if entry.get("size") is None:
            return self.file(address)
        return RemoteFile(address, int(entry["size"]), _version(entry))

    def _ask(self, question: Any, path: str, **options: Any) -> Any:
        return fsspec.asyn.sync(self.system.loop, question, path, timeout=ANSWER_S, **options)


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
    return {**fresh, ("session_kwargs" if scheme == "gs" else "client_kwargs"): {"timeout": timeout}}


@contextmanager
def _faults_named(address: str) -> Iterator[None]:
    """Turn whatever fsspec and the libraries below it raise into one line about an address."""
    began = time.monotonic()
    try:
        yield
    except ClearwayError:
        raise
    except Exception as fault:  # each store's library has a hundred kinds of its own, without a common base
        told = _told(fault, address, time.monotonic() - began)
        raise ClearwayError(f"{without_secrets(address)}: {told}") from fault


def _told(fault: Exception, address: str, seconds: float) -> str:
    """What went wrong, and the remedy; without secrets, which the library's words may repeat."""
    hidden = isinstance(fault, FileNotFoundError) and str(fault).startswith("http")  # whatever happened, fsspec says so
    cause = fault.__cause__ or fault if hidden else fault
    words = addresses_without_secrets(str(cause).replace(address, without_secrets(address)))
    reason = " ".join(words.split())[:200] or type(cause).__name__
    kind = type(cause).__name__
    if isinstance(cause, FileNotFoundError) or getattr(cause, "status", None) == 404:
        return "there is nothing there. Check the address"
    if any(word in kind for word in _CREDENTIALS) or getattr(cause, "status", None) in (401, 403):
        return f"may not be opened ({reason}). Check the credentials and their rights, see docs/scenes.md"
    if isinstance(cause, TimeoutError) or "Timeout" in kind:
        return f"no answer in {seconds:.0f} s. Check the network and the server, then try again"
    return f"cannot be reached or read ({reason}). Check the address and the network, then try again"
