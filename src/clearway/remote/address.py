"""Addresses of files elsewhere, such as s3://bucket/rooms, written where a path may stand."""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlsplit

from clearway.files import cache_dir

EXTRAS = {"s3": "s3", "gs": "gs", "https": "https", "http": "https"}  # what to install, by scheme
COPIED_NS = 10**18  # time of change that every copy has, so that one that comes again is the same
ENTRY = re.compile(r"[0-9a-f]{32}-(\d{1,20})")  # see `cache`
_ADDRESS = re.compile(rf"({'|'.join(EXTRAS)}):/+([^/].*)", re.DOTALL)
_IN_WORDS = re.compile(r"https?:/+\S+?(?=['\")\]>.,;]*(?:\s|$))")  # less what closes a bracket or sentence


def address_of(path: str | os.PathLike[str]) -> str | None:
    """The address that a path stands for; None for one on this machine. `Path` makes one slash of an address's two."""
    found = _ADDRESS.fullmatch(path.as_posix() if isinstance(path, Path) else os.fspath(path))
    return f"{found[1]}://{found[2]}" if found else None


def file_name(address: str) -> str:
    """The last part of an address, without a web address's query."""
    parts = urlsplit(address)
    path = unquote(parts.path) if parts.scheme.startswith("http") else address
    return PurePosixPath(path).name


def without_secrets(address: str) -> str:
    """A web address without name and password, and without its query, such as a signature; also one made a `Path`."""
    if not address.startswith("http"):
        return address
    scheme, _, rest = address.partition("?")[0].partition(":")
    host, slash, path = rest.lstrip("/").partition("/")
    return f"{scheme}://{host.rpartition('@')[2]}{slash}{path}"


def addresses_without_secrets(words: str) -> str:
    """Words with every web address in them as `without_secrets` has it."""
    return _IN_WORDS.sub(lambda found: without_secrets(found[0]), words)


def fetched_folder() -> Path:
    """Where files that were fetched are kept, each in a folder of its own, its entry."""
    return cache_dir() / "remote"


def is_fetched(path: Path) -> bool:
    """Whether a path is that of a file which was fetched; it may have gone since, to make room for others."""
    if not ENTRY.fullmatch(path.parent.name):
        return False
    parent, own = path.parent.parent, fetched_folder()
    return parent == own or parent.resolve() == own.resolve()


def entry_bytes(entry: str) -> int:
    """Size of the file of an entry."""
    return int(entry.partition("-")[2])


def is_whole(path: Path) -> bool:
    """Whether a file that was fetched is there as it was fetched."""
    try:
        status = path.stat()
    except OSError:
        return False
    return (status.st_size, status.st_mtime_ns) == (entry_bytes(path.parent.name), COPIED_NS)


def file_bytes(path: Path) -> int:
    """Size of a file, of one that was fetched also when it has gone. Raises OSError where there is none."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        if is_fetched(own := path.resolve()):
            return entry_bytes(own.parent.name)
        raise
