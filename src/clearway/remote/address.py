"""Addresses of files elsewhere, such as s3://bucket/rooms, written where a path may stand."""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlsplit

from clearway.files import cache_dir, read_json

MAX_RECORD_BYTES = 64 * 1024
EXTRAS = {"s3": "s3", "gs": "gs", "https": "https", "http": "https"}  # what to install, by scheme
RECORDS = ".records"  # where every file came from that was fetched, by its entry's name
_ADDRESS = re.compile(rf"({'|'.join(EXTRAS)}):/+([^/].*)", re.DOTALL)


def address_of(path: str | os.PathLike[str]) -> str | None:
    """The address that a path stands for; None for one on this machine. `Path` makes one slash of an address's two."""
    found = _ADDRESS.fullmatch(path.as_posix() if isinstance(path, Path) else os.fspath(path))
    return f"{found[1]}://{found[2]}" if found else None


def file_name(address: str) -> str:
    """The last part of an address, without a web address's query."""
    parts = urlsplit(address)
    path = unquote(parts.path) if parts.scheme.startswith("http") else address
    return PurePosixPath(path).name


def without_query(address: str) -> str:
    """A web address without what stands behind its question mark, such as a signature, which is nobody else's."""
    return address.partition("?")[0] if address.startswith("http") else address


def fetched_folder() -> Path:
    """Where files that were fetched are kept, each in a folder of its own, its entry."""
    return cache_dir() / "remote"


def is_fetched(path: Path) -> bool:
    """Whether a path is that of a file which was fetched; it may have gone since, to make room for others."""
    return path.resolve().parent.parent == fetched_folder().resolve()


def origin(path: Path) -> str:
    """Where a file can be had again: the address of one that was fetched, the whole path of any other."""
    path = path.resolve()
    if is_fetched(path):
        return str(read_json(fetched_folder() / RECORDS / path.parent.name, MAX_RECORD_BYTES)["address"])
    return str(path)
