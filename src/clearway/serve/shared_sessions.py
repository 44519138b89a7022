"""Sessions that several replicas of a service share: any of them answers any request, whichever dies."""

from __future__ import annotations

import asyncio
import logging
import sqlite3
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from clearway.deploy.agent import DeployedAgent
from clearway.deploy.navigator import Selection
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.session_record import Shapes, UnsealedError, most_record_bytes, sealed, shapes_of, unsealed
from clearway.serve.session_table import SessionTable
from clearway.serve.sessions import Progress, Session, begun_state, new_session, no_such_session, too_many
from clearway.serve.tokens import Tokens

Found = TypeVar("Found")


class SharedSessions:
    """Sessions in a table; see `KeepsSessions`. What an answer rests on is in the table before the answer is sent.

    Args:
        table: shared by all replicas.
        most: sessions.
        owners: gives the names that share them.
        key: seals the records.
        shapes: of the agent's state.
    """

    def __init__(
        self, table: SessionTable, most: int, owners: Callable[[], Collection[str]], key: bytes, shapes: Shapes
    ) -> None:
        self._table, self._most, self._owners, self._key, self._shapes = table, most, owners, key, shapes
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="sessions")
        self._counter = ThreadPoolExecutor(1, thread_name_prefix="count")  # a beat waits for no other's request
        self._known: OrderedDict[str, Session] = OrderedDict()  # that this replica has had to do with
        self._count = 0  # lately

    def __len__(self) -> int:
        return self._count

    @property
    def full(self) -> bool:
        """No more can be opened."""
        return self._count >= self._most

    async def recount(self) -> None:
        """Count the sessions of all replicas anew."""
        self._count = await self._asked(self._counter, self._table.count)

    async def open(self, owner: str, selection: Selection, seed: int | None) -> Session:
        """See `KeepsSessions`. Cancelled, it leaves none."""
        made = new_session(owner, selection, seed, 0.0)
        record = sealed(made, made.progress, self._key)
        held, cancelled = await self._settled(self._table.open, made.id, owner, record, list(self._owners()))
        if cancelled is not None:
            if held is None:
                await self._forget(made.id)
            raise cancelled
        if held is not None:
            raise too_many(held)
        return self._remembered(made)

    async def get(self, session_id: str, owner: str) -> Session:
        """See `KeepsSessions`."""
        if not await self._asked(self._thread, self._table.touch, session_id, owner):
            raise no_such_session()
        found = self._known.get(session_id)
        if found is None:
            header, _ = await self._read(session_id)
            found = Session(session_id, header["owner"], header["selection"], header["seed"], 0.0)
        return self._remembered(found)

    async def close(self, session_id: str, owner: str) -> None:
        """See `KeepsSessions`."""
        await self.get(session_id, owner)
        await self._forget(session_id)

    async def progress(self, session: Session) -> Progress:
        """See `KeepsSessions`."""
        return (await self._read(session.id))[1]

    async def keep(self, session: Session, before: Progress, after: Progress) -> bool:
        """See `KeepsSessions`."""
        record = sealed(session, after, self._key)
        kept, cancelled = await self._settled(self._table.write, session.id, before.version, record)
        if cancelled is not None and not kept:
            raise cancelled
        return kept

    async def _read(self, session_id: str) -> tuple[dict[str, Any], Progress]:
        """Header and progress of a session. Raises Fault where it is gone, or was altered: then it goes."""
        found = await self._asked(self._thread, self._table.read, session_id)
        if found is None:
            raise no_such_session()
        version, record = found
        try:
            header, progress = unsealed(record, self._key, self._shapes)
            if header["id"] != session_id:
                raise UnsealedError("it is another session's")
        except UnsealedError as fault:
            logging.getLogger("clearway.serve").error("the record of a session is refused: %s", fault)
            await self._forget(session_id)
            raise no_such_session() from fault
        return header, replace(progress, version=version)

    def _remembered(self, session: Session) -> Session:
        """Its turn and how its pictures have been stay here, for as many as there may be."""
        self._known[session.id] = session
        self._known.move_to_end(session.id)
        if len(self._known) > self._most:
            self._known.popitem(last=False)
        return session

    async def _forget(self, session_id: str) -> None:
        self._known.pop(session_id, None)
        await self._settled(self._table.remove, session_id)

    async def _asked(self, thread: ThreadPoolExecutor, ask: Callable[..., Found], *arguments: object) -> Found:
        """What the table answers, in a thread. Raises Fault where it cannot."""
        with _table_needed():
            return await asyncio.get_running_loop().run_in_executor(thread, ask, *arguments)

    async def _settled(
        self, change: Callable[..., Found], *arguments: object
    ) -> tuple[Found, asyncio.CancelledError | None]:
        """What the table answers to a change, and the cancellation that came once the change had begun.

        A thread that writes cannot be cancelled: who asked for the change must know whether it was made. Cancelled
        before it has begun, it is not made. Raises Fault as `_asked`.
        """
        asked = self._thread.submit(change, *arguments)
        answer, cancelled = asyncio.wrap_future(asked), None
        while not answer.done():
            try:
                await asyncio.wait([answer])
            except asyncio.CancelledError as late:
                if asked.cancel():
                    raise
                cancelled = late
        with _table_needed():
            return answer.result(), cancelled


def sessions_in(folder: Path, agent: DeployedAgent, limits: Limits, tokens: Tokens, key: bytes) -> SharedSessions:
    """The sessions of an agent in the table that lies in a folder.

    Args:
        folder: that all replicas share.
        agent: whose states the records hold.
        limits: of the whole service.
        tokens: whose owners share the sessions.
        key: seals the records.
    """
    shapes = shapes_of(begun_state(agent))
    table = SessionTable(folder / "sessions", limits.sessions, most_record_bytes(shapes), limits.idle_s)
    return SharedSessions(table, limits.sessions, lambda: tokens.owners, key, shapes)


@contextmanager
def _table_needed() -> Iterator[None]:
    """Raises Fault, and logs why, where the table cannot be used."""
    try:
        yield
    except sqlite3.Error as fault:
        logging.getLogger("clearway.serve").error("sessions cannot be kept: %s", fault)
        raise Fault("overloaded", "no session can be kept now. Try again") from fault
