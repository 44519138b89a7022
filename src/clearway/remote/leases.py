"""Which files of the cache stay for as long as a process lives, so that nobody removes them.

Each process holds a lease: a list of entries, and a lock that the system frees when the process ends.
"""

from __future__ import annotations

import atexit
import functools
import os
import threading
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from clearway.regular_files import read_text
from clearway.remote.address import ENTRY

MAX_LIST_BYTES = 64 * 1024**2  # of the entries that a process keeps
LEASES = ".leases"
_MAKING = threading.Lock()


class Lease:
    """What this process keeps of a cache, written where others see it; all of it under the cache's lock."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / LEASES / f"{os.getpid()}-{os.urandom(4).hex()}"
        self.uses: Counter[str] = Counter()
        self.process = os.getpid()
        self.lock = FileLock(self._lock_path)
        self.lock.acquire()
        atexit.register(self.end)

    @property
    def _lock_path(self) -> Path:
        return Path(f"{self.path}.lock")

    def add(self, entries: Iterable[str]) -> None:
        """Keep some entries once more."""
        self.uses.update(entries)
        self._write()

    def drop(self, entries: Iterable[str]) -> None:
        """Give some entries back that were added."""
        self.uses -= Counter(entries)
        self._write()

    def _write(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        if not self._lock_path.exists():  # its user has emptied the cache, and others would take this for abandoned
            self.lock.release(force=True)
            self.lock = FileLock(self._lock_path)
            self.lock.acquire()
        part = Path(f"{self.path}.part")
        part.write_text("".join(f"{entry}\n" for entry in self.uses), encoding="utf-8")
        part.replace(self.path)

    def end(self) -> None:
        """Give the lease back; a forked process has none of its own to give."""
        if os.getpid() == self.process:
            self.path.unlink(missing_ok=True)
            self.lock.release()
            self._lock_path.unlink(missing_ok=True)


def lease_of(folder: Path) -> Lease:
    """The lease of this process; a forked one has another than the process it was forked from."""
    with _MAKING:
        return _made(folder, os.getpid())


@functools.cache
def _made(folder: Path, process: int) -> Lease:
    return Lease(folder)


def leased(folder: Path) -> set[str]:
    """What living processes keep; the leases of others are removed."""
    entries: set[str] = set()
    own = lease_of(folder)
    (folder / LEASES).mkdir(parents=True, exist_ok=True)
    for path in (folder / LEASES).iterdir():
        if path.suffix in (".lock", ".part"):
            continue
        if path != own.path and _is_free(Path(f"{path}.lock")):
            path.unlink(missing_ok=True)
            continue
        with suppress(OSError, ValueError):  # given back meanwhile, or damaged: who reads what goes has it come again
            entries.update(filter(ENTRY.fullmatch, read_text(path, MAX_LIST_BYTES).split()))
    return entries


def _is_free(lock: Path) -> bool:
    """Whether nobody holds a lock."""
    try:
        with FileLock(lock, timeout=0):
            lock.unlink(missing_ok=True)
            return True
    except Timeout:
        return False
