"""What goes wrong on the way to files elsewhere: as one line, and whether another try may do."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from clearway.errors import ClearwayError
from clearway.remote.address import addresses_without_secrets, without_secrets

_CREDENTIALS = ("Credential", "Permission", "Refresh", "Profile", "Token", "Forbidden")  # in names of errors
_FOR_THE_MOMENT = {  # names of errors and of their bases, since no package of theirs need be installed
    "TimeoutError",
    "ConnectionError",
    "ClientConnectionError",  # aiohttp's
    "ClientPayloadError",
    "HTTPClientError",  # botocore's, and the next
    "IncompleteRead",
    "ResponseParserError",
}


@contextmanager
def faults_named(address: str) -> Iterator[None]:
    """Turn whatever fsspec and the libraries below it raise into one line about an address."""
    began = time.monotonic()
    try:
        yield
    except ClearwayError:
        raise
    except Exception as fault:  # each store's library has a hundred kinds of its own, without a common base
        told = _told(fault, address, time.monotonic() - began)
        raise ClearwayError(f"{without_secrets(address)}: {told}") from fault


def _told(fault: Exception, address: str, seconds: float) -> str:
    """What went wrong, and the remedy; without secrets, which the library's words may repeat."""
    cause = _cause(fault)
    words = addresses_without_secrets(str(cause).replace(address, without_secrets(address)))
    reason = " ".join(words.split())[:200] or type(cause).__name__
    kind = type(cause).__name__
    if isinstance(cause, FileNotFoundError) or getattr(cause, "status", None) == 404:
        return "there is nothing there. Check the address"
    if any(word in kind for word in _CREDENTIALS) or getattr(cause, "status", None) in (401, 403):
        return f"may not be opened ({reason}). Check the credentials and their rights, see docs/scenes.md"
    if isinstance(cause, TimeoutError) or "Timeout" in kind:
        return f"no answer in {seconds:.0f} s. Check the network and the server, then try again"
    return f"cannot be reached or read ({reason}). Check the address and the network, then try again"


def _cause(fault: BaseException) -> BaseException:
    """What a fault is about: of web servers fsspec says that a file is not there, whatever happened."""
    hidden = isinstance(fault, FileNotFoundError) and str(fault).startswith("http")
    return fault.__cause__ or fault if hidden else fault


def is_for_the_moment(fault: BaseException) -> bool:
    """Whether the next try may do: silence, a connection that broke, or a server that is too busy or has failed."""
    cause = _cause(fault)
    status = _status(cause.__cause__ or cause)  # s3fs has translated what botocore raised
    return status == 429 or status >= 500 or not _FOR_THE_MOMENT.isdisjoint(kind.__name__ for kind in type(cause).mro())


def _status(fault: BaseException) -> int:
    """The status with which a server answered; 0 where it did not."""
    answer = getattr(fault, "response", None)
    metadata = answer.get("ResponseMetadata", {}) if isinstance(answer, dict) else {}
    return int(metadata.get("HTTPStatusCode") or getattr(fault, "status", None) or 0)
