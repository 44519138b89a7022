"""`SessionTable`: sessions in a database that several processes of one machine share, whichever of them dies."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from clearway.serve.sessions import place_refused
from clearway.serve.shares import Places

TABLES = """
CREATE TABLE IF NOT EXISTS sessions (id TEXT PRIMARY KEY, owner TEXT NOT NULL, used_s REAL NOT NULL, version INTEGER);
CREATE INDEX IF NOT EXISTS used ON sessions (used_s);
CREATE TABLE IF NOT EXISTS records (id TEXT PRIMARY KEY, record BLOB NOT NULL);
CREATE TRIGGER IF NOT EXISTS gone AFTER DELETE ON sessions BEGIN DELETE FROM records WHERE id = old.id; END;
"""
PAGE_BYTES = 4096
SPARE_PAGES = 1000  # for indices, and for what is changed before the old is gone
LOG_BYTES = 64 << 20  # to which SQLite's write-ahead log is cut once it has been written to the table
PATIENCE_S = 3.0  # for another process to finish its change, each of which takes a millisecond


class SessionTable:
    """Records of sessions, each with a version: only who knows the newest may write the next.

    A change is whole or not at all, also where its process is killed in the middle. The table is not synced to the
    disk: it need not outlive the machine. One thread may count while another does the rest.

    Args:
        path: of the database; it is made where there is none.
        most: sessions.
        most_bytes: of a record.
        idle_s: seconds after which a session is gone that nobody has used.
        clock: seconds, monotonic, the same in all processes.

    Raises:
        sqlite3.Error: as do all methods, where the database cannot be used now, for example as its disk is full.
    """

    def __init__(
        self, path: Path, most: int, most_bytes: int, idle_s: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._most, self._most_bytes, self._idle_s, self._clock = most, most_bytes, idle_s, clock
        pages = most * (most_bytes // PAGE_BYTES + 3) + SPARE_PAGES
        self._database = _connected(path, pages)
        self._database.executescript(TABLES)
        self._counted = _connected(path, pages)

    def open(self, session_id: str, owner: str, record: bytes, owners: Collection[str]) -> str | None:
        """Add a session, where there is room for another one of this owner's among all `owners`; else says why not."""
        self._check_size(record)
        with self._change():
            self._expire(self._database)
            places = Places(self._most, lambda: owners, dict(self._database.execute(HELD)))
            if (refusal := place_refused(places, owner)) is not None:
                return refusal
            self._database.execute("INSERT INTO sessions VALUES (?, ?, ?, 0)", (session_id, owner, self._clock()))
            self._database.execute("INSERT INTO records VALUES (?, ?)", (session_id, record))
        return None

    def touch(self, session_id: str, owner: str) -> bool:
        """Whether there is such a session of this owner's; its time begins anew."""
        now = self._clock()
        touched = "UPDATE sessions SET used_s = ? WHERE id = ? AND owner = ? AND used_s > ?"
        return self._database.execute(touched, (now, session_id, owner, now - self._idle_s)).rowcount == 1

    def read(self, session_id: str) -> tuple[int, bytes] | None:
        """Version and record of a session; None where there is none."""
        found = "SELECT version, record FROM sessions JOIN records USING (id) WHERE id = ? AND used_s > ?"
        row = self._database.execute(found, (session_id, self._clock() - self._idle_s)).fetchone()
        return row and (row[0], row[1])

    def write(self, session_id: str, version: int, record: bytes) -> bool:
        """Put a record in the place of that with this version; False where that is not the newest one any more."""
        self._check_size(record)
        changed = "UPDATE sessions SET version = version + 1, used_s = ? WHERE id = ? AND version = ?"
        with self._change():
            if self._database.execute(changed, (self._clock(), session_id, version)).rowcount != 1:
                return False
            self._database.execute("UPDATE records SET record = ? WHERE id = ?", (record, session_id))
        return True

    def remove(self, session_id: str) -> None:
        """Forget a session, where there is such."""
        self._database.execute("DELETE FROM sessions WHERE id = ?", (session_id,))

    def count(self) -> int:
        """Sessions."""
        self._expire(self._counted)
        return int(self._counted.execute("SELECT count(*) FROM sessions").fetchone()[0])

    def close(self) -> None:
        """Leave the database."""
        self._database.close()
        self._counted.close()

    def _check_size(self, record: bytes) -> None:
        assert len(record) <= self._most_bytes, f"a record of {len(record)} bytes, expected at most {self._most_bytes}"

    def _expire(self, database: sqlite3.Connection) -> None:
        database.execute("DELETE FROM sessions WHERE used_s <= ?", (self._clock() - self._idle_s,))

    @contextmanager
    def _change(self) -> Iterator[None]:
        self._database.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._database.execute("COMMIT")
        except BaseException:
            if self._database.in_transaction:  # else SQLite has taken it back itself, as where there is no room
                self._database.execute("ROLLBACK")
            raise


def _connected(path: Path, pages: int) -> sqlite3.Connection:
    """A connection to a database of at most so many pages."""
    database = sqlite3.connect(path, PATIENCE_S, isolation_level=None, check_same_thread=False)
    for name, value in (
        ("page_size", PAGE_BYTES),
        ("journal_mode", "wal"),
        ("synchronous", "off"),
        ("journal_size_limit", LOG_BYTES),
        ("max_page_count", pages),
    ):
        database.execute(f"PRAGMA {name} = {value}")
    return database


HELD = "SELECT owner, count(*) FROM sessions GROUP BY owner"
