"""Sessions in a table that replicas share: to the bit, refused once altered, bounded, gone in time."""

from __future__ import annotations

import asyncio
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.service import Service
from clearway.serve.session_record import UnsealedError, most_record_bytes, sealed, shapes_of, unsealed
from clearway.serve.session_table import SessionTable
from clearway.serve.sessions import begun_state, new_session
from clearway.serve.shared_sessions import SharedSessions
from helpers.agents import equal
from helpers.serving import OWNER, TOKENS, grey
from helpers.session_records import KEY, assert_goes_on_to_the_bit, walked
from helpers.sums import Sums

SHAPES = shapes_of(begun_state(Sums()))


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def shared(
    path: Path, most: int = 10, clock: Clock | None = None, owners: tuple[str, ...] = (OWNER,)
) -> SharedSessions:
    table = SessionTable(path / "sessions", most, most_record_bytes(SHAPES), 60.0, clock or Clock())
    return SharedSessions(table, most, lambda: owners, KEY, SHAPES)


def slowed(monkeypatch, table: SessionTable, name: str, seconds: float = 0.4) -> threading.Event:
    """Let a method of the table take time before it does what it does; is set once it has begun."""
    done, begun = getattr(table, name), threading.Event()

    def slow(*arguments: object) -> object:
        begun.set()
        time.sleep(seconds)
        return done(*arguments)

    monkeypatch.setattr(table, name, slow)
    return begun


async def cancelled_once(begun: threading.Event, task: asyncio.Task) -> None:
    await asyncio.to_thread(begun.wait)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


def test_a_state_goes_on_to_the_bit_after_a_round_trip() -> None:
    assert_goes_on_to_the_bit(Sums())


def test_what_was_altered_is_refused() -> None:
    session, (progress, _) = new_session(OWNER, "sampled", 3, 0.0), walked(Sums())
    record = sealed(session, progress, KEY)
    for place in (0, 31, 32, 40, len(record) // 2, len(record) - 1):
        altered = bytearray(record)
        altered[place] ^= 1
        with pytest.raises(UnsealedError, match="seal"):
            unsealed(bytes(altered), KEY, SHAPES)
    for cut in (b"", record[:20], record[:-1], record + b"x"):
        with pytest.raises(UnsealedError, match="seal"):
            unsealed(cut, KEY, SHAPES)
    with pytest.raises(UnsealedError, match="seal"):
        unsealed(record, bytes(32), SHAPES)
    with pytest.raises(UnsealedError, match="another agent's"):
        unsealed(record, KEY, {**SHAPES, "more": (np.dtype("f4"), (1,))})


def test_an_altered_record_ends_its_session_alone(tmp_path, caplog) -> None:
    async def ask() -> None:
        sessions = shared(tmp_path)
        first, second = [await sessions.open(OWNER, "sampled", 1) for _ in range(2)]
        record = sessions._table.read(second.id)[1]
        assert sessions._table.write(first.id, 0, record)  # a good one, of another session
        with pytest.raises(Fault, match="no such session"):
            await sessions.progress(first)
        assert (await sessions.progress(second)).steps == 0
        await sessions.recount()
        assert len(sessions) == 1

    asyncio.run(ask())
    assert "another session's" in caplog.text


def test_replicas_see_each_other_s_and_only_one_writes_what_comes_next(tmp_path) -> None:
    async def ask() -> None:
        ours, theirs = shared(tmp_path), shared(tmp_path)
        mine = await ours.open(OWNER, "argmax", 5)
        same = await theirs.get(mine.id, OWNER)
        assert (same.selection, same.seed) == ("argmax", 5)
        before, seen_there = await ours.progress(mine), await theirs.progress(same)
        after = walked(Sums())[0]
        assert await ours.keep(mine, before, after)
        assert not await theirs.keep(same, seen_there, after)
        found = await theirs.progress(same)
        assert found.steps == 3 and equal(found.state, after.state)
        with pytest.raises(Fault, match="no such session"):
            await theirs.get(mine.id, "another")
        await theirs.close(mine.id, OWNER)
        with pytest.raises(Fault, match="no such session"):
            await ours.progress(mine)
        assert not await ours.keep(mine, found, after)

    asyncio.run(ask())


def test_sessions_are_bounded_over_all_replicas_by_names_and_in_time(tmp_path) -> None:
    clock = Clock()

    async def ask() -> None:
        replicas = [shared(tmp_path, 4, clock, ("crowd", "guest")) for _ in range(2)]
        for number in range(2):
            await replicas[number].open("crowd", "sampled", None)
        with pytest.raises(Fault, match="2 sessions of this token"):
            await replicas[0].open("crowd", "sampled", None)
        clock.now += 30
        kept = await replicas[0].open("guest", "sampled", None)
        await replicas[1].open("guest", "sampled", None)
        await replicas[0].recount()
        assert replicas[0].full
        with pytest.raises(Fault, match="4 sessions are open"):
            await replicas[0].open("guest", "sampled", None)
        clock.now += 40  # the crowd's have expired
        await replicas[1].get(kept.id, "guest")
        await replicas[0].recount()
        assert len(replicas[0]) == 2
        clock.now += 40
        await replicas[0].recount()
        assert len(replicas[0]) == 1

    asyncio.run(ask())


def test_a_table_that_is_full_refuses_in_words_and_keeps_what_it_has(tmp_path, caplog) -> None:
    async def ask() -> None:
        sessions = shared(tmp_path, 10_000)
        sessions._table._database.execute("PRAGMA max_page_count = 40")
        opened = []
        with pytest.raises(Fault, match="no session can be kept now") as caught:
            for _ in range(1000):
                opened.append(await sessions.open(OWNER, "sampled", None))
        assert caught.value.code == "overloaded"
        assert (await sessions.progress(opened[0])).episode == 0

    asyncio.run(ask())
    assert "full" in caplog.text


def test_a_record_that_is_too_large_is_our_own_mistake(tmp_path) -> None:
    with pytest.raises(AssertionError, match="expected at most 10"):
        SessionTable(tmp_path / "sessions", 1, 10, 60.0).open("id", OWNER, bytes(11), [OWNER])


def test_a_step_that_was_kept_is_answered_though_the_deadline_passes(tmp_path, called, monkeypatch) -> None:
    """It was once refused, and walked."""
    service = Service(Sums(), Limits(deadline_s=1.0), TOKENS)
    sessions = service.sessions = shared(tmp_path)
    client, png = called(service), {"content-type": "image/png"}
    session = f"/sessions/{client.post('/sessions', json={}).json()['session_id']}"
    for _ in range(20):  # a busy machine starts decoders for longer than the deadline
        if client.put(f"{session}/target", content=grey(2), headers=png).status_code == 204:
            break
    slowed(monkeypatch, sessions._table, "write", 1.2)
    assert client.put(f"{session}/target", content=grey(2), headers=png).status_code == 204
    answer = client.post(f"{session}/steps", content=grey(1), headers=png)
    assert (answer.status_code, answer.json()["step"]) == (200, 1)
    with client.websocket_connect(f"{session}/stream") as socket:
        socket.send_bytes(grey(1))
        assert '"step":2' in socket.receive_text()


def test_what_was_cancelled_in_time_changes_nothing(tmp_path, monkeypatch) -> None:
    async def ask() -> None:
        sessions, after = shared(tmp_path), walked(Sums())[0]
        session = await sessions.open(OWNER, "sampled", None)
        before, ends = await sessions.progress(session), threading.Event()
        sessions._thread.submit(ends.wait)
        keeping = asyncio.create_task(sessions.keep(session, before, after))
        await asyncio.sleep(0.05)
        keeping.cancel()
        await asyncio.wait([keeping], timeout=2)
        ends.set()
        assert keeping.cancelled()
        assert (await sessions.progress(session)).version == before.version
        assert await sessions.keep(session, before, after)
        stale = asyncio.create_task(sessions.keep(session, before, after))
        await cancelled_once(slowed(monkeypatch, sessions._table, "write"), stale)  # it had come too late anyway

    asyncio.run(ask())


def test_an_opening_that_was_cancelled_leaves_no_session(tmp_path, monkeypatch) -> None:
    async def ask() -> None:
        sessions = shared(tmp_path)
        begun = slowed(monkeypatch, sessions._table, "open")
        await cancelled_once(begun, asyncio.create_task(sessions.open(OWNER, "sampled", None)))
        await asyncio.get_running_loop().run_in_executor(sessions._thread, int)  # all before it is done
        await sessions.recount()
        assert len(sessions) == 0

    asyncio.run(ask())


def test_another_name_that_knows_a_session_does_not_keep_it(tmp_path) -> None:
    clock = Clock()

    async def ask() -> None:
        sessions = shared(tmp_path, clock=clock)
        session = await sessions.open(OWNER, "sampled", None)
        clock.now += 40
        with pytest.raises(Fault, match="no such session"):
            await sessions.get(session.id, "another")
        clock.now += 40
        with pytest.raises(Fault, match="no such session"):
            await sessions.get(session.id, OWNER)

    asyncio.run(ask())


def test_a_count_waits_for_no_request(tmp_path) -> None:
    """A replica that does not beat is ended as stuck."""

    async def ask() -> None:
        sessions, ends = shared(tmp_path), threading.Event()
        await sessions.open(OWNER, "sampled", None)
        sessions._thread.submit(ends.wait)
        try:
            await asyncio.wait_for(sessions.recount(), 5)
        finally:
            ends.set()
        assert len(sessions) == 1

    asyncio.run(ask())
