"""What is limited for each address counts a customer's whole part of IPv6."""

from __future__ import annotations

import asyncio
import socket
from unittest.mock import Mock

import pytest

from clearway.serve.addresses import counted_as
from clearway.serve.attempts import Attempts
from clearway.serve.connections import Strangers, reset
from clearway.serve.handshakes import Handshakes

ONE, TWIN, OTHER = "2001:db8::1", "2001:db8:0:0:ffff::2", "2001:db8:0:1::1"


@pytest.mark.parametrize(
    ("address", "counted"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        (ONE, "2001:db8::/64"),
        (TWIN, "2001:db8::/64"),
        (OTHER, "2001:db8:0:1::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("testclient", "testclient"),
        ("", ""),
    ],
)
def test_addresses_as_they_are_counted(address: str, counted: str) -> None:
    assert counted_as(address) == counted


def test_wrong_tokens() -> None:
    attempts = Attempts(2, lambda: 0.0)
    for address in (ONE, TWIN):
        attempts.note(address, "wrong", False)
    assert not attempts.may_try(ONE, "new") and not attempts.may_try(TWIN, "new") and attempts.may_try(OTHER, "new")
    attempts.note(ONE, "right", True)
    assert attempts.may_try(TWIN, "right")


def test_connections_without_a_token() -> None:
    strangers = Strangers(1, TWIN)
    first, proxy, far, second = (Mock(address=address, owner=None) for address in (ONE, TWIN, OTHER, "2001:db8::3"))
    for connection in (first, proxy, far):
        strangers.add(connection)
    assert not first.transport.abort.called
    strangers.add(second)
    assert first.transport.abort.called and not far.transport.abort.called and not proxy.transport.abort.called
    for connection in (first, second, far):
        strangers.remove(connection)
    assert not strangers._open


def test_handshakes() -> None:
    async def held() -> tuple[bytes, int]:
        handshakes = Handshakes(1, 60.0, None)
        (ours, theirs), (other, theirs_too) = socket.socketpair(), socket.socketpair()
        with ours, theirs, other, theirs_too:
            handshakes.begin(ours, ONE)
            handshakes.begin(other, TWIN)
            theirs.settimeout(1)
            ended = theirs.recv(1)
            handshakes.done(other.fileno(), TWIN)
        return ended, len(handshakes._open)

    assert asyncio.run(held()) == (b"", 0)


def test_a_connection_over_tls_that_was_closed_twice_is_cut_off() -> None:
    """Asked for its socket it failed, which stood in the log for every client that did not read at the end."""
    transport = asyncio.sslproto._SSLProtocolTransport(None, Mock())  # type: ignore[attr-defined]
    transport.close()
    transport.close()
    reset(transport)
    assert transport.is_closing()
