"""What SIGHUP renews while a service runs: its tokens, its certificate; and what certificates give."""

from __future__ import annotations

import logging
import signal
import ssl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType

from clearway.errors import ClearwayError
from clearway.serve.tokens import Tokens, read_tokens


@contextmanager
def on_hangup(renew: Callable[[], object]) -> Iterator[None]:
    """Let SIGHUP call this meanwhile, and then what it called before; also in a process that was to ignore it (nohup).

    No effect on Windows.
    """
    if not hasattr(signal, "SIGHUP"):
        yield
        return
    before = signal.getsignal(signal.SIGHUP)

    def hear(number: int, frame: FrameType | None) -> None:
        renew()
        if callable(before):
            before(number, frame)

    signal.signal(signal.SIGHUP, hear)
    try:
        yield
    finally:
        signal.signal(signal.SIGHUP, before)


@contextmanager
def rotating(tokens: Tokens, path: Path | None) -> Iterator[None]:
    """Let SIGHUP read the file of tokens again meanwhile, where there is one."""
    if path is None:
        yield
        return
    with on_hangup(partial(_read_again, tokens, path)):
        yield


def _read_again(tokens: Tokens, path: Path) -> None:
    log = logging.getLogger("clearway.serve")
    try:
        tokens.replace(read_tokens(path))
    except ClearwayError as fault:
        log.error("the tokens stay as they were: %s", fault)
    else:
        log.warning("tokens were read again from %s", path)


def tls_of(certificate: Path, key: Path | None) -> ssl.SSLContext:
    """TLS by a certificate. Raises OSError where it or its key cannot be read, or they are no pair."""
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(certificate, key, password="")
    return tls


def renew_certificate(tls: ssl.SSLContext, certificate: Path, key: Path | None) -> None:
    """Let connections from now on be encrypted by what is in the files by now; where that is no pair, as before.

    A context has a place for each kind of key, so a certificate of another kind would not take the place of the one
    before: connections are handed on to a context of the new one alone.
    """
    log = logging.getLogger("clearway.serve")
    try:
        renewed = tls_of(certificate, key)
    except OSError as fault:  # ssl.SSLError is one
        log.error("%s: %s; the one before is used on", certificate, fault.strerror or fault)
    else:

        def hand_on(connection: ssl.SSLObject, name: str | None, context: ssl.SSLContext) -> None:
            connection.context = renewed

        tls.sni_callback = hand_on  # asked for every connection, also without a name
        log.warning("the certificate was read again from %s", certificate)
