"""Who may ask: the tokens of a service, each with the name of its owner."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Sequence
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.regular_files import opened, read_at_most
from clearway.web.guard import same_token

OWNER = "clearway.owner"  # in the scope of a request: the name of its token
ANSWERED = "clearway.answered"  # in the scope of a WebSocket: to be called of every answer
KNOWN = "clearway.known"  # in the state of a request: told the owner and its token once that was right; False: too many
ALONE = "default"  # the owner where there is one token
FEWEST_LETTERS = 16
MOST_NAME_LETTERS = 100  # which every record of a session holds
MOST_BYTES = 1 << 20  # of a file of tokens


class Tokens:
    """Tokens by the names of their owners; an owner may have several.

    Args:
        named: names and tokens.
    """

    def __init__(self, named: Sequence[tuple[str, str]]) -> None:
        self._named, self._all = tuple(named), frozenset(named)
        self.owners = frozenset(name for name, _ in named)
        self._told: Callable[[], object] | None = None

    def when_replaced(self, tell: Callable[[], object]) -> None:
        """Let this be called whenever others have taken their place."""
        self._told = tell

    def replace(self, other: Tokens) -> None:
        """Take another's instead of the own."""
        self._named, self._all, self.owners = other._named, other._all, other.owners
        if self._told is not None:
            self._told()

    def owner_of(self, given: str) -> str | None:
        """The name of a token's owner, None where there is no such token; how long it takes tells nothing of them."""
        found = None
        for name, token in self._named:
            if same_token(given, token):
                found = name
        return found

    def has(self, owner: str, token: str) -> bool:
        """Whether a token that was right is the owner's still."""
        return (owner, token) in self._all


def checked_token(token: str, what: str) -> str:
    """The token. Raises ClearwayError where it is too weak or cannot be sent; `what` it is stands in the message."""
    if len(token) < FEWEST_LETTERS or not (token.isascii() and token.isprintable()) or " " in token:
        problem = f"{what} holds no token of at least {FEWEST_LETTERS} plain letters"
        raise ClearwayError(f"{problem}. Choose another, or leave it out for a random one")
    return token


def read_tokens(path: Path) -> Tokens:
    """The tokens of a file: a name and a token a line; empty lines and those that begin with # say nothing.

    Raises:
        ClearwayError: it cannot be read, others may read it, or it says something else.
    """
    named: list[tuple[str, str]] = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) != 2:
            raise ClearwayError(f"{path}, line {number}: expected a name and a token. Write them with a space between")
        if len(words[0]) > MOST_NAME_LETTERS:
            problem = f"{path}, line {number}: a name of {len(words[0])} letters, expected at most {MOST_NAME_LETTERS}"
            raise ClearwayError(f"{problem}. Choose a shorter one")
        token = checked_token(words[1], f"{path}, line {number},")
        if others := {name for name, own in named if own == token and name != words[0]}:
            problem = f"{path}, line {number}: the token of {words[0]} is that of {others.pop()}, too"
            raise ClearwayError(f"{problem}. Give each a token of their own")
        named.append((words[0], token))
    if not named:
        raise ClearwayError(f"{path}: no tokens in it. Write a name and a token a line")
    return Tokens(named)


def _text(path: Path) -> str:
    """What a regular file says, which only its owner may read."""
    try:
        with opened(path) as file:
            if os.fstat(file.fileno()).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
                raise ClearwayError(f"{path}: others may read or change it. Forbid it them: chmod 600 {path}")
            return read_at_most(file, MOST_BYTES, path).decode("utf-8", "replace")
    except OSError as fault:
        raise ClearwayError(f"{path}: cannot be read ({fault.strerror}). Name a file of tokens") from fault
