"""Processes that decode strangers' pictures: each is bounded in memory and time, killed when it overruns, and replaced.

A session whose picture overran goes through a slow process for a while, which yields the processor to everything else;
so do the new sessions of a token that has let pictures overrun again and again.
"""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import math
import socket
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass

import numpy as np

from clearway.children import command_of
from clearway.deploy.agent import MAX_PICTURE_SIDE
from clearway.serve.decoder import ANSWER, ASKED, BUFFER_BYTES, PIXELS, REFUSED
from clearway.serve.decoding import Bounds
from clearway.serve.faults import STATUS, Fault
from clearway.serve.limits import Limits
from clearway.serve.shares import FairTurns, Shares

NICENESS, SLOW_NICENESS = 5, 19  # yields to the agent; to all others
FAILED_S = 10.0  # for which a service is not ready after a decoder could not be started
SUSPECT_S = 60.0  # for which the pictures of a session are decoded slowly, one of which has overrun
MOST_REFUSAL_BYTES = 500  # of a decoder's
MOST_OVERRUNS_S = 1.0  # of decoding lately in vain for a token, beyond which its new sessions are decoded slowly


@dataclass(eq=False)
class Standing:
    """How the pictures of a session have been.

    Attributes:
        proven: one was decoded quickly.
        slow_until_s: none is tried quickly before that time.
    """

    proven: bool = False
    slow_until_s: float = 0.0


class _Ended(Exception):
    """A decoder ended, or was ended, before its answer."""


class Decoder:
    """A decoder process. Start it in a thread that lives as long as it shall: the system ends it with that thread.

    Args:
        limits: of pictures, and of its memory.
        niceness: how far it yields the processor.
    """

    def __init__(self, limits: Limits, niceness: int) -> None:
        self._bounds = Bounds(limits.picture_pixels, MAX_PICTURE_SIDE, limits.picture_scans)
        job = {"bounds": asdict(self._bounds), "memory_bytes": limits.decoder_bytes, "nice": niceness}
        self._job, self.niceness = json.dumps(job), niceness
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False
        self.begun_s: float | None = None  # when its present picture came to it

    def start(self) -> None:
        """Start it, where it does not run, or no longer. Raises OSError."""
        if self._closed:
            raise OSError(errno.ESHUTDOWN, "the service ends")
        if self._process is not None and self._process.poll() is None:
            return
        self.end()
        words = [*command_of("clearway.serve.decoder"), self._job]
        ours, theirs = socket.socketpair()
        with theirs:
            try:
                self._process = subprocess.Popen(
                    words, stdin=theirs.fileno(), stdout=subprocess.DEVNULL, start_new_session=True
                )  # in a session of its own, where Ctrl+C does not reach it: requests under way are answered first
            except OSError:
                ours.close()
                raise
        ours.setblocking(False)
        for size in (socket.SO_SNDBUF, socket.SO_RCVBUF):
            ours.setsockopt(socket.SOL_SOCKET, size, BUFFER_BYTES)
        self._connection = ours

    def end(self) -> None:
        """Kill it."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None
            self._connection.close()

    def close(self) -> None:
        """Kill it, and start it no more; who waits for its answer gets an error."""
        self._closed = True
        if self.begun_s is None:
            self.end()
        elif self._process is not None:
            self._process.kill()
            self._process.wait()

    async def decode(self, content: bytes, seconds: float, patience_s: float) -> np.ndarray:
        """The picture, (height, width, 3) uint8.

        Args:
            content: of the file.
            seconds: of processor time that it may take.
            patience_s: seconds that pass before it is held for stalled, and ended.

        Raises:
            Fault: it is refused.
            _Ended: the process has ended, or was ended for lack of time or a senseless answer; another one is to be
                started.
            OSError: no process can be started.
        """
        self.start()
        self.begun_s = time.monotonic()
        try:
            async with asyncio.timeout(patience_s):
                return await self._answered(content, seconds)
        except (TimeoutError, EOFError, ConnectionError, ValueError) as fault:
            self.end()
            raise _Ended from fault
        except asyncio.CancelledError:  # its answer would be taken for the next picture's
            self.end()
            raise
        finally:
            self.begun_s = None

    async def _answered(self, content: bytes, seconds: float) -> np.ndarray:
        """The answer of a process that strangers' pictures may have taken over. Raises ValueError where it is none."""
        loop = asyncio.get_running_loop()
        await loop.sock_sendall(self._connection, ASKED.pack(len(content), round(1000 * seconds)) + content)
        kind, first, second = ANSWER.unpack(await self._received(ANSWER.size))
        if kind == REFUSED and first <= MOST_REFUSAL_BYTES:
            raise _refusal(bytes(await self._received(first)))
        if kind != PIXELS or first * second > self._bounds.pixels or max(first, second) > self._bounds.side:
            raise ValueError("more than was asked for")
        if not first or not second:
            raise ValueError("no picture")
        pixels = await self._received(first * second * 3)
        return np.frombuffer(pixels, np.uint8).reshape(first, second, 3)

    async def _received(self, length: int) -> bytearray:
        found, loop, have = bytearray(length), asyncio.get_running_loop(), 0
        view = memoryview(found)
        while have < length:
            more = await loop.sock_recv_into(self._connection, view[have:])
            if not more:
                raise EOFError
            have += more
        return found


def _refusal(told: bytes) -> Fault:
    """A decoder's refusal. Raises ValueError where it is none."""
    match json.loads(told):
        case [str(code), str(message)] if code in STATUS:
            return Fault(code, message)
    raise ValueError("no refusal")


class Lane:
    """Decoders of one kind, whose turns are shared fairly.

    Args:
        limits: see `Decoder`; how long a decoder may seem stalled.
        niceness: of each, see `Decoder`; who has used more than the mean gets the one that yields the most.
        seconds: of processor time a picture.
    """

    def __init__(self, limits: Limits, niceness: Sequence[int], seconds: float) -> None:
        self.decoders = [Decoder(limits, each) for each in niceness]
        self._idle, self._limits, self._seconds = list(self.decoders), limits, seconds
        self._shares = Shares()
        self._turns = FairTurns(len(self.decoders), self._shares)

    async def decode(self, content: bytes, owner: str) -> np.ndarray:
        """See `Decoder.decode`."""
        async with self._turns.turn(owner):
            choose = max if self._shares.is_above_mean(owner) else min
            self._idle.remove(decoder := choose(self._idle, key=lambda each: each.niceness))
            try:
                return await decoder.decode(content, self._seconds, self._limits.stall_s)
            finally:
                with suppress(OSError):  # the next picture tries again, and says so
                    decoder.start()
                self._idle.append(decoder)

    @property
    def stalled(self) -> bool:
        """Every decoder has been busy with its picture for longer than one may take."""
        most = time.monotonic() - 2 * self._seconds
        return all(decoder.begun_s is not None and decoder.begun_s < most for decoder in self.decoders)


class Decoders:
    """All decoders of a service; they start when they are needed, or by `start`.

    Args:
        limits: what is allowed.
    """

    def __init__(self, limits: Limits) -> None:
        self._quick = Lane(limits, [0, *[NICENESS] * limits.decoders], limits.decode_s)
        self._slow = Lane(limits, [SLOW_NICENESS], limits.slow_decode_s)
        self._limits, self._overruns, self._failed_s = limits, Shares(), -math.inf
        self.replaced = 0  # decoders that were ended

    @property
    def stalled(self) -> bool:
        """Pictures are not decoded as they should be.

        Where no decoder could be started it is so for a while, and then no more: a service that is sent no pictures
        would never learn that decoders start again.
        """
        return time.monotonic() - self._failed_s < FAILED_S or self._quick.stalled

    def start(self) -> None:
        """Let decoders be ready for the first pictures. Raises OSError."""
        for decoder in self._quick.decoders:
            decoder.start()

    def close(self) -> None:
        """End all decoders."""
        for decoder in self._quick.decoders + self._slow.decoders:
            decoder.close()

    async def decode(self, content: bytes, owner: str, standing: Standing) -> np.ndarray:
        """The picture in a file, (height, width, 3) uint8 RGB.

        Args:
            content: of the file.
            owner: whose it is; owners share the decoders fairly.
            standing: of its session.

        Raises:
            Fault: it is refused, or takes too much time or memory.
        """
        if self._is_trusted(owner, standing):
            try:
                picture = await self._tried(self._quick, content, owner)
                standing.proven = True
                return picture
            except _Ended:
                standing.slow_until_s = time.monotonic() + SUSPECT_S
                self._overruns.add(owner, self._limits.decode_s)
        try:
            return await self._tried(self._slow, content, owner)
        except _Ended as fault:
            raise Fault("unreadable_picture", "the picture takes too long to decode. Send a simpler one") from fault

    def _is_trusted(self, owner: str, standing: Standing) -> bool:
        if standing.slow_until_s > time.monotonic():
            return False
        return standing.proven or self._overruns.used(owner) < MOST_OVERRUNS_S

    async def _tried(self, lane: Lane, content: bytes, owner: str) -> np.ndarray:
        try:
            picture = await lane.decode(content, owner)
        except _Ended:
            self.replaced += 1
            raise
        except OSError as fault:
            self._failed_s = time.monotonic()
            logging.getLogger("clearway.serve").error("no decoder can be started (%s)", fault.strerror)
            raise Fault("overloaded", "no picture can be decoded now. Try again") from fault
        except Fault:  # a decoder has answered, if only to refuse the picture
            self._failed_s = -math.inf
            raise
        self._failed_s = -math.inf
        return picture
