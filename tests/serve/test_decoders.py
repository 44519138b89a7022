"""Decoder processes: bounded, killed, replaced, ended with their service."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable
from contextlib import closing
from typing import TypeVar
from unittest.mock import Mock

import numpy as np
import pytest

from clearway.serve.decoder import ANSWER, PIXELS, REFUSED
from clearway.serve.decoders import FAILED_S, Decoder, Decoders, Standing, _Ended
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.service import Service
from helpers.serving import ENVIRONMENT, OWNER, TOKENS, grey, picture_bytes
from helpers.sums import Sums, plain

Result = TypeVar("Result")
PATIENT_S = 20  # for what must happen, on a busy machine
NOISE = np.random.default_rng(0).integers(0, 256, (900, 1200, 3), np.uint8)
HEAVY = picture_bytes(NOISE, "WEBP", quality=90, method=0)  # some 60 ms of processor time
HASTY = Limits(decode_s=0.01, slow_decode_s=5, stall_s=PATIENT_S)


def with_decoders(limits: Limits, task: Callable[[Decoders], Awaitable[Result]]) -> Result:
    async def run() -> Result:
        with closing(Decoders(limits)) as decoders:
            return await task(decoders)

    return asyncio.run(run())


def processes(decoders: Decoders) -> list[int]:
    lanes = decoders._quick.decoders + decoders._slow.decoders
    return [decoder._process.pid for decoder in lanes if decoder._process is not None]


def is_there(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_pictures_come_back_and_refusals_too() -> None:
    async def task(decoders: Decoders) -> None:
        found = await decoders.decode(picture_bytes(NOISE), OWNER, Standing())
        assert np.array_equal(found, NOISE)
        for content, code in ((b"nonsense", "unsupported_picture"), (grey(1)[:-28], "unreadable_picture")):
            with pytest.raises(Fault) as caught:
                await decoders.decode(content, OWNER, Standing())
            assert caught.value.code == code
        assert decoders.replaced == 0

    with_decoders(Limits(), task)


def test_a_picture_that_overruns_is_tried_slowly_and_the_next_ones_at_once() -> None:
    async def task(decoders: Decoders) -> None:
        standing = Standing()
        for _ in range(2):
            assert (await decoders.decode(HEAVY, OWNER, standing)).shape == NOISE.shape
            assert decoders.replaced == 1  # by the first alone
        assert not standing.proven
        await decoders.decode(grey(1), "another", other := Standing())
        assert other.proven and not decoders.stalled

    with_decoders(HASTY, task)


def test_a_picture_that_overruns_slowly_too_is_refused() -> None:
    async def task(decoders: Decoders) -> None:
        with pytest.raises(Fault, match="takes too long to decode"):
            await decoders.decode(HEAVY, OWNER, Standing())
        assert decoders.replaced == 2
        assert (await decoders.decode(grey(7), OWNER, Standing())).max() == 7

    with_decoders(Limits(decode_s=0.01, slow_decode_s=0.02, stall_s=PATIENT_S), task)


def test_who_lets_pictures_overrun_in_ever_new_sessions_is_slow_in_all_but_proven_ones() -> None:
    async def task(decoders: Decoders) -> None:
        proven = Standing(proven=True)
        decoders._overruns.add(OWNER, 1.5)
        await decoders.decode(grey(1), OWNER, new := Standing())
        assert not new.proven and len(processes(decoders)) == 1  # the slow one
        await decoders.decode(grey(1), OWNER, proven)
        assert len(processes(decoders)) == 2

    with_decoders(Limits(), task)


def test_memory_is_bounded() -> None:
    async def task(decoders: Decoders) -> None:
        with pytest.raises(Fault) as caught:
            await decoders.decode(picture_bytes(np.zeros((4000, 4000, 3), np.uint8)), OWNER, Standing())
        assert caught.value.code == "unreadable_picture"

    with_decoders(Limits(picture_pixels=4000 * 4000, decoder_bytes=90 << 20), task)


@pytest.mark.parametrize(
    "answer",
    [
        ANSWER.pack(PIXELS, 2**32 - 1, 2**32 - 1),
        ANSWER.pack(PIXELS, 11, 10) + bytes(330),
        ANSWER.pack(PIXELS, 5000, 0),
        ANSWER.pack(PIXELS, 0, 5),
        ANSWER.pack(PIXELS, 5, 0),
        ANSWER.pack(7, 1, 1) + bytes(3),
        ANSWER.pack(REFUSED, 2**32 - 1, 0) + bytes(1000),
        ANSWER.pack(REFUSED, 4, 0) + b"nope",
        ANSWER.pack(REFUSED, 10, 0) + b'["no", ""]',
        ANSWER.pack(REFUSED, 2, 0) + b"[]",
    ],
    ids=[
        "huge",
        "too many pixels",
        "too long",
        "no rows",
        "no columns",
        "of no kind",
        "a long refusal",
        "no JSON",
        "of no code",
        "empty",
    ],
)
def test_a_decoder_whose_answer_is_none_is_ended(answer: bytes) -> None:
    """Its numbers were believed: 12 bytes could ask for all memory there is."""

    async def task() -> bool:
        decoder, process = Decoder(Limits(picture_pixels=100), 0), Mock(poll=lambda: None)
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        decoder._process, decoder._connection = process, ours
        with theirs:
            theirs.sendall(answer)
            with pytest.raises(_Ended):
                await decoder.decode(b"a file", 1.0, 0.5)
        return process.kill.called

    assert asyncio.run(task())


def test_a_stalled_decoder_is_noticed_ended_and_replaced() -> None:
    async def task(decoders: Decoders) -> None:
        decoders._quick.decoders[1:] = []
        decoders._quick._idle[:] = decoders._quick.decoders
        await decoders.decode(grey(1), OWNER, Standing())
        (process,) = processes(decoders)
        os.kill(process, signal.SIGSTOP)
        asked = asyncio.create_task(decoders.decode(grey(9), OWNER, Standing()))
        until = time.monotonic() + PATIENT_S
        while not decoders.stalled and time.monotonic() < until:
            await asyncio.sleep(0.01)
        assert decoders.stalled and not asked.done()
        assert (await asked).max() == 9
        assert not decoders.stalled and not is_there(process) and process not in processes(decoders)

    with_decoders(Limits(decode_s=0.1, stall_s=3.0), task)


def test_a_decoder_that_was_killed_meanwhile_costs_nobody_a_picture() -> None:
    async def task(decoders: Decoders) -> None:
        decoders.start()
        for process in processes(decoders):
            os.kill(process, signal.SIGKILL)
            os.waitid(os.P_PID, process, os.WEXITED | os.WNOWAIT)
        assert (await decoders.decode(grey(3), OWNER, Standing())).max() == 3
        assert decoders.replaced == 0

    with_decoders(Limits(), task)


def test_the_answer_to_a_picture_given_up_is_nobody_else_s() -> None:
    async def task(decoders: Decoders) -> None:
        for _ in range(5):
            given_up = asyncio.create_task(decoders.decode(HEAVY, OWNER, Standing()))
            await asyncio.sleep(0.02)
            given_up.cancel()
            assert (await decoders.decode(grey(5), OWNER, Standing())).shape == plain(5).shape

    with_decoders(Limits(), task)


def test_a_service_whose_decoders_cannot_start_is_not_ready(monkeypatch) -> None:
    async def task() -> None:
        service = Service(Sums(), Limits(), TOKENS)
        session = await service.open(OWNER, "argmax", None)
        monkeypatch.setattr(sys, "executable", "/nowhere/python")
        with closing(service.decoders):
            with pytest.raises(Fault, match="no picture can be decoded"):
                await service.set_target(session, grey(1))
            assert not service.ready
            later = time.monotonic() + FAILED_S
            with monkeypatch.context() as patch:
                patch.setattr(time, "monotonic", lambda: later)
                assert service.ready  # who is sent no picture would never learn that decoders start again
            monkeypatch.undo()
            with pytest.raises(Fault, match="picture"):  # a decoder that refuses a picture has started
                await service.set_target(session, b"no picture")
            assert service.ready

    asyncio.run(task())


def test_none_is_left_once_they_are_closed() -> None:
    async def task(decoders: Decoders) -> list[int]:
        asked = asyncio.create_task(decoders.decode(HEAVY, OWNER, Standing()))
        await asyncio.sleep(0.02)
        decoders.start()
        found = processes(decoders)
        decoders.close()
        with pytest.raises(Fault):
            await asked
        return found

    started = with_decoders(Limits(), task)
    assert started and not any(map(is_there, started))


PROGRAM = """
import asyncio, os, signal
from clearway.serve.decoders import Decoders
from clearway.serve.limits import Limits
from helpers.serving import grey

async def main():
    decoders = Decoders(Limits())
    decoders.start()
    for decoder in decoders._quick.decoders:
        await decoder.decode(grey(1), 5.0, 60.0)
        os.kill(decoder._process.pid, signal.SIGSTOP)  # as if it were busy: it hears of no closed connection
    print(*(decoder._process.pid for decoder in decoders._quick.decoders), flush=True)
    await asyncio.sleep(60)

signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup starts programs that ignore it
asyncio.run(main())
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP], ids=lambda number: number.name)
def test_decoders_end_with_their_parent(number) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], env=ENVIRONMENT, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        started = [int(word) for word in parent.stdout.readline().split()]
        assert started and all(map(is_there, started))
        parent.send_signal(number)
    until = time.monotonic() + PATIENT_S
    while any(map(is_there, started)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not any(map(is_there, started))
