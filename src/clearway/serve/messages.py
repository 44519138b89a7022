"""WebSockets whose messages are bounded: nothing is read before a right token has come, and what is held takes places.

`impatient` makes the classes of all connections of a service.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Any

from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from clearway.serve.admitted import Admitted
from clearway.serve.connections import Impatient, ImpatientHttp, Strangers, reset
from clearway.serve.faults import AGAIN, POLICY, TOO_BIG
from clearway.serve.handshakes import Handshakes
from clearway.serve.limits import Limits
from clearway.serve.shares import Places

MOST_FRAGMENTS = 1024  # of a message
MESSAGE_BYTES = 512  # that a message takes beside its content


class ImpatientSocket(Impatient, WebSocketsSansIOProtocol):
    """A WebSocket whose client reads its answers within `patience_s` and sends a message within `message_s`.

    Nothing is read before the application has accepted it. All that is held of messages, from their first byte to their
    answer, takes places of the owner's.
    """

    bodies: Places
    message_s: float
    _held = 0  # bytes that have taken places
    _given_up = False
    _rest: asyncio.TimerHandle | None = None

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._unanswered: deque[int] = deque()  # bytes of each whole message that is not answered yet
        self._unanswered_bytes = 0
        self._answering = False  # the first of them has gone to the application

    def handle_connect(self, event: Any) -> None:
        """Leave what follows unread until the application asks for it: it does once the token was right."""
        super().handle_connect(event)
        if not self.transport.is_closing():
            self.read_paused = True
            self.transport.pause_reading()

    def data_received(self, data: bytes) -> None:
        """Count what is held now."""
        super().data_received(data)
        self._hold()

    def handle_cont(self, event: Any) -> None:
        """Take a part of a message, unless there are too many: each takes more than its content."""
        super().handle_cont(event)
        if len(self.frames) > MOST_FRAGMENTS:
            self.frames = []
            self._give_up(TOO_BIG, f"a message comes in more than {MOST_FRAGMENTS} parts")

    def send_receive_event_to_app(self) -> None:
        """Keep a whole message until it is answered."""
        if not self.close_sent:
            self._unanswered.append(sum(map(len, self.frames)) + MESSAGE_BYTES)
            self._unanswered_bytes += self._unanswered[-1]
        super().send_receive_event_to_app()

    async def receive(self) -> Any:
        """The next message; the one before is answered, and held no more."""
        if self._answering:
            self._unanswered_bytes -= self._unanswered.popleft()
            self._answering = False
            self._hold()
        message = await super().receive()
        self._answering = message["type"] == "websocket.receive"
        if not self.writable.is_set() and not self.transport.is_closing():
            self.transport.pause_reading()
        self._hold()
        return message

    async def send(self, message: Any) -> None:
        """Pass a message on; a refusal completes the handshake, of which uvicorn would complain.

        Raises:
            ClientDisconnected: the connection was given up.
        """
        if self._given_up:
            raise ClientDisconnected
        await super().send(message)
        self.handshake_complete = self.handshake_complete or self.close_sent

    def pause_writing(self) -> None:
        """Read no more meanwhile: who does not read could have answers to pings pile up."""
        super().pause_writing()
        self.transport.pause_reading()

    def resume_writing(self) -> None:
        """Read on, unless a message waits for the application."""
        super().resume_writing()
        if not self.read_paused and not self.transport.is_closing():
            self.transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """Hold nothing any more."""
        self._stop_waiting_for_rest()
        self._take(0)
        super().connection_lost(exc)

    def _hold(self) -> None:
        """Take places for what is held, and wait for the rest of a message where that is to be read."""
        begun = len(self.conn.reader.buffer) + sum(map(len, self.frames))
        if self.transport.is_closing():
            return
        if not self._take(begun + self._unanswered_bytes):
            return self._give_up(AGAIN, "too many large messages are under way. Try again")
        if not begun or self.read_paused:
            self._stop_waiting_for_rest()
        elif self._rest is None:
            told = f"the message did not arrive within {self.message_s:g} s"
            self._rest = self.loop.call_later(self.message_s, self._give_up, POLICY, told)

    def _take(self, count: int) -> bool:
        """Whether there were places; `count` in all."""
        more, owner = count - self._held, self.owner
        if owner is None:  # nothing is read before there is one
            return not more
        if more > 0 and not self.bodies.take(owner, more):
            return False
        if more < 0:
            self.bodies.free(owner, -more)
        self._held = count
        return True

    def _stop_waiting_for_rest(self) -> None:
        if self._rest is not None:
            self._rest.cancel()
            self._rest = None

    def revoke(self) -> None:
        """End the stream, or the handshake."""
        if self.handshake_complete and not self.transport.is_closing():
            self._give_up(POLICY, "the token is no longer taken")
        else:
            reset(self.transport)

    def _give_up(self, code: int, reason: str) -> None:
        """End the connection, and tell the client why."""
        self._given_up = True
        self.conn.fail(code, reason)
        self.close_sent = True
        self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.transport.close()


def impatient(
    limits: Limits,
    places: Places,
    bodies: Places,
    admitted: Admitted,
    strangers: Strangers,
    handshakes: Handshakes,
    health_port: int | None = None,
) -> tuple[type[asyncio.Protocol], type[asyncio.Protocol]]:
    """The classes for HTTP and for WebSockets with those limits, and places for connections and for bytes under way."""
    both = {"patience_s": limits.patience_s, "places": places, "admitted": admitted}
    before = {"strangers": strangers, "handshakes": handshakes, "health_port": health_port}
    return (
        type("ImpatientHttp", (ImpatientHttp,), {**both, **before}),
        type("ImpatientSocket", (ImpatientSocket,), {**both, "message_s": limits.deadline_s, "bodies": bodies}),
    )
