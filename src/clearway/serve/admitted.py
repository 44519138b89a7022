"""Connections that a right token has opened: each ends once its token is taken back."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack, suppress
from typing import Protocol

from clearway.serve.tokens import Tokens


class Revocable(Protocol):
    """A connection that can be ended."""

    loop: asyncio.AbstractEventLoop

    def revoke(self) -> None:
        """End it, and say why where there is a way to."""


class Admitted:
    """Keeps them, by the token that each showed last.

    Args:
        tokens: which may be replaced at any time, also by a signal's handler.
    """

    def __init__(self, tokens: Tokens) -> None:
        self._tokens = tokens
        self._open: dict[Revocable, tuple[str, str]] = {}
        tokens.when_replaced(self._look_soon)

    def add(self, connection: Revocable, owner: str, token: str) -> None:
        """Keep a connection whose token was right just now."""
        self._open[connection] = (owner, token)
        if not self._tokens.has(owner, token):  # a signal came in between
            self._look_soon()

    def remove(self, connection: Revocable) -> None:
        """Keep it no more."""
        self._open.pop(connection, None)

    def _look_soon(self) -> None:
        for connection in list(self._open)[:1]:
            with suppress(RuntimeError):  # the loop has ended, and all connections with it
                connection.loop.call_soon_threadsafe(self._look)

    def _look(self) -> None:
        with ExitStack() as revoked:  # one that fails keeps no other open
            for connection, (owner, token) in list(self._open.items()):
                if not self._tokens.has(owner, token):
                    self.remove(connection)
                    revoked.callback(connection.revoke)
