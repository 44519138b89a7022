"""Which files of the cache living processes use, so that nobody removes them.

Each process holds a lease: a list of entries, and a lock that the system frees when the process ends.
"""

from __future__ import annotations

import atexit
import functools
import os
import threading
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from clearway.regular_files import read_text

MAX_LIST_BYTES = 64 * 1024**2  # of the entries that a process uses
LEASES = ".leases"
PART = ".part"
_MAKING = threading.Lock()


class Lease:
    """What this process uses of a cache, written where others see it; threads share it."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / LEASES / f"{os.getpid()}-{os.urandom(4).hex()}"
        self.uses: Counter[str] = Counter()
        self.process = os.getpid()
        self.lock = FileLock(f"{self.path}.lock")
        self.lock.acquire()
        self.threads = threading.Lock()
        atexit.register(self.end)

    def hold(self, entries: Iterable[str]) -> None:
        """Use some entries once more."""
        with self.threads:
            self.uses.update(entries)
            self._write()

    def hold_again(self, entries: Sequence[str]) -> bool:
        """Use some entries once more if all are in use already, of which nobody has to hear."""
        with self.threads:
            known = all(entry in self.uses for entry in entries)
            if known:
                self.uses.update(entries)
            return known

    def give_back(self, entries: Iterable[str]) -> None:
        """End one use of some entries."""
        with self.threads:
            before = len(self.uses)
            for entry in entries:
                self.uses[entry] -= 1
                if not self.uses[entry]:
                    del self.uses[entry]
            if len(self.uses) < before:
                self._write()

    def end(self) -> None:
        """Give the lease back; a forked process has none of its own to give."""
        if os.getpid() == self.process:
            self.path.unlink(missing_ok=True)
            self.path.with_suffix(PART).unlink(missing_ok=True)
            self.lock.release()
            Path(f"{self.path}.lock").unlink(missing_ok=True)

    def _write(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)  # its user may have emptied the cache
        part = self.path.with_suffix(PART)  # others read the list at any time
        part.write_text("".join(f"{entry}\n" for entry in self.uses), encoding="utf-8")
        part.replace(self.path)


def lease_of(folder: Path) -> Lease:
    """The lease of this process; a forked one has another than the process it was forked from."""
    with _MAKING:
        return _made(folder, os.getpid())


@functools.cache
def _made(folder: Path, process: int) -> Lease:
    return Lease(folder)


def leased(folder: Path) -> set[str]:
    """What living processes use; the leases of others are removed."""
    entries: set[str] = set()
    own = lease_of(folder)
    (folder / LEASES).mkdir(parents=True, exist_ok=True)
    for path in (folder / LEASES).iterdir():
        if path.suffix:  # a lock, or what is being written
            continue
        if path != own.path and _is_free(Path(f"{path}.lock")):
            path.unlink(missing_ok=True)
            path.with_suffix(PART).unlink(missing_ok=True)
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
