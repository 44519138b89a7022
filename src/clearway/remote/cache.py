"""Files from elsewhere on this machine: fetched whole or not at all, within a limit, the least recently used out first.

A file lies in a folder of its own in the cache folder, under `remote`, whose name is made of its address, version and
size; beside it `address.txt`. What a living process has fetched stays: each holds a lease, a list of its files with a
lock that the system frees when the process ends.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import math
import os
import shutil
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from clearway.errors import ClearwayError
from clearway.files import CACHE_VARIABLE, locked, part_folder
from clearway.progress import picture_progress
from clearway.regular_files import read_text
from clearway.remote.address import ADDRESS_FILE, fetched_folder, without_query
from clearway.remote.store import RemoteFile, Store

MAX_LIST_BYTES = 64 * 1024**2  # of the entries that a process uses
LIMIT_VARIABLE = "CLEARWAY_CACHE_GB"
LIMIT_GB = 50.0
AT_ONCE = 16  # files that are fetched at a time
LEASES = ".leases"


def fetched(addresses: Sequence[str], suffixes: Sequence[str]) -> list[Path]:
    """Files on this machine: those that addresses name, folders by the files in them with such endings, in order.

    Those stay in the cache for as long as this process lives.

    Raises:
        ClearwayError: nothing is there, it cannot be had, or the cache is too small.
    """
    stores = {address: Store(address) for address in addresses}
    with ThreadPoolExecutor(AT_ONCE) as asking:
        found = list(asking.map(lambda address: stores[address].files(address, suffixes), addresses))
    files = {file: stores[address] for address, some in zip(addresses, found, strict=True) for file in some}
    folder = fetched_folder()
    try:
        places = _prepared(folder, list(files))
        _fetch({file: store for file, store in files.items() if not places[file].exists()}, places, folder)
    except OSError as fault:
        remedy = f"Make room, or set {CACHE_VARIABLE} to another folder"
        raise ClearwayError(f"{folder}: cannot keep what is fetched ({fault.strerror or fault}). {remedy}") from fault
    return [places[file] for some in found for file in some]


def _prepared(folder: Path, files: Sequence[RemoteFile]) -> dict[RemoteFile, Path]:
    """Where files lie or will lie; they are leased, and there is room for them."""
    places = {file: folder / _entry(file) / file.name for file in files}
    with locked(folder / ".cache"):
        lease = _lease(folder, os.getpid())
        lease.add([place.parent.name for place in places.values()])
        for file, place in places.items():
            if place.exists() and place.stat().st_size != file.size:  # damaged since
                shutil.rmtree(place.parent)
            elif place.exists():
                os.utime(place.parent)
        _make_room(folder, lease)
    return places


def _make_room(folder: Path, own: _Lease) -> None:
    """Remove files that nobody has leased until all others and those that are leased fit into the limit.

    Raises:
        ClearwayError: those that are leased do not fit.
    """
    limit_gb = _limit_gb()
    leased = _leased(folder)
    size = sum(map(_size, leased))
    if size > limit_gb * 1e9:
        wanted = sum(map(_size, own.entries))
        problem = f"{wanted / 1e9:,.1f} GB are to be kept here, {(size - wanted) / 1e9:,.1f} GB by others that run now"
        raise ClearwayError(f"{folder}: {problem}, the limit is {limit_gb:g} GB. Set {LIMIT_VARIABLE} to more")
    free = [entry for entry in os.scandir(folder) if entry.name not in leased and _is_entry(entry.name)]
    size += sum(_size(entry.name) for entry in free)
    for entry in sorted(free, key=lambda entry: entry.stat().st_mtime):
        if size <= limit_gb * 1e9:
            break
        shutil.rmtree(entry.path)
        size -= _size(entry.name)


def _limit_gb() -> float:
    words = os.environ.get(LIMIT_VARIABLE)
    if not words:
        return LIMIT_GB
    try:
        limit = float(words)
    except ValueError:
        limit = math.nan
    if not limit > 0:
        raise ClearwayError(f"{LIMIT_VARIABLE}={words:.40}: expected a number of gigabytes. Set it to one, such as 50")
    return limit


def _fetch(files: dict[RemoteFile, Store], places: dict[RemoteFile, Path], folder: Path) -> None:
    """Download files; each appears in its place once it is whole."""
    if not files:
        return

    with (
        part_folder(folder) as part,
        picture_progress("fetching", len(files), len(files) > 1, unit="files") as show_done,
        ThreadPoolExecutor(AT_ONCE) as pool,
    ):

        def fetch(file: RemoteFile) -> None:
            final = places[file].parent
            new = part / final.name
            new.mkdir()
            files[file].download(file, new / file.name)
            (new / ADDRESS_FILE).write_text(without_query(file.address), encoding="utf-8")
            try:
                new.replace(final)
            except OSError:
                if not places[file].exists():  # else another process was faster
                    raise

        waiting = [pool.submit(fetch, file) for file in files]
        try:
            for done, future in enumerate(waiting, 1):
                future.result()
                show_done(done)
        finally:
            for future in waiting:
                future.cancel()


def _entry(file: RemoteFile) -> str:
    """The name of a file's folder: what it is, and its bytes."""
    digest = hashlib.sha256(f"{file.address}\n{file.version}".encode()).hexdigest()
    return f"{digest[:32]}-{file.size}"


def _is_entry(name: str) -> bool:
    digest, _, size = name.partition("-")
    return len(digest) == 32 and size.isdigit()


def _size(entry: str) -> int:
    return int(entry.partition("-")[2])


class _Lease:
    """What this process has fetched into a cache, written where others see it."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / LEASES / f"{os.getpid()}-{os.urandom(4).hex()}"
        self.entries: dict[str, None] = {}
        self.process = os.getpid()
        self.lock = FileLock(f"{self.path}.lock")
        self.lock.acquire()
        atexit.register(self.end)

    def add(self, entries: Sequence[str]) -> None:
        """Write further entries down."""
        self.entries.update(dict.fromkeys(entries))
        self.path.parent.mkdir(parents=True, exist_ok=True)  # its user may have emptied the cache
        self.path.write_text("".join(f"{entry}\n" for entry in self.entries), encoding="utf-8")

    def end(self) -> None:
        """Give the lease back; a forked process has none of its own to give."""
        if os.getpid() == self.process:
            self.path.unlink(missing_ok=True)
            self.lock.release()
            Path(f"{self.path}.lock").unlink(missing_ok=True)


@functools.cache
def _lease(folder: Path, process: int) -> _Lease:
    """The lease of this process, whose number tells it from the one it was forked from."""
    return _Lease(folder)


def _leased(folder: Path) -> set[str]:
    """What living processes have fetched; the leases of others are removed."""
    entries: set[str] = set()
    own = _lease(folder, os.getpid())
    for path in (folder / LEASES).iterdir():
        if path.suffix == ".lock":
            continue
        if path != own.path and _is_free(Path(f"{path}.lock")):
            path.unlink(missing_ok=True)
            continue
        with suppress(FileNotFoundError):  # its process has given it back meanwhile
            entries.update(read_text(path, MAX_LIST_BYTES).split())
    return entries


def _is_free(lock: Path) -> bool:
    """Whether nobody holds a lock."""
    try:
        with FileLock(lock, timeout=0):
            lock.unlink(missing_ok=True)
            return True
    except Timeout:
        return False
