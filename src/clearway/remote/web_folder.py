"""The files in a folder of a web server, as the page says that lists them.

What a page says is not trusted: it is read up to a limit, and only files of that very folder count.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from html.parser import HTMLParser
from typing import Any
from urllib.parse import SplitResult, urljoin, urlsplit

MAX_PAGE_BYTES = 8 * 1024**2
MAX_LINKS = 100_000
PIECE = 64 * 1024  # characters that are looked through at a time
PORTS = {"http": 80, "https": 443}  # where an address names none


class PageTooLong(OSError):
    """A page says more than is read, or what nobody can read."""


async def files_of_page(system: Any, folder: str) -> list[dict[str, Any]]:
    """What a folder holds directly.

    Args:
        system: fsspec's for the web.
        folder: its address, with a slash at the end.

    Returns:
        Of each file its address, `name`; how large it is, is not known yet, so that `size` is None.

    Raises:
        FileNotFoundError: there is no such page.
        PageTooLong: it is larger than 8 MiB, or has more than 100,000 links.
        Exception: the server cannot be asked, as fsspec says it.
    """
    session = await system.set_session()
    async with session.get(system.encode_url(folder), **system.kwargs) as answer:
        system._raise_not_found_for_status(answer, folder)
        page = bytearray()
        async for block in answer.content.iter_any():
            page += block
            if len(page) > MAX_PAGE_BYTES:
                raise PageTooLong(f"its page of files is larger than {MAX_PAGE_BYTES // 1024**2} MiB")
    files = FilesOfPage(folder, str(answer.url))
    text = page.decode("utf-8", "replace")
    for start in range(0, len(text), PIECE):
        files.feed(text[start : start + PIECE])
        await asyncio.sleep(0)  # whoever waits may give it up
    return [{"name": name, "size": None} for name in files.found]


class FilesOfPage(HTMLParser):
    """Collects the files directly in a folder that a page links to.

    Args:
        folder: its address, as it was asked for.
        page: where the page was found, to which its links refer.

    Attributes:
        found: their addresses, each once.
    """

    def __init__(self, folder: str, page: str) -> None:
        super().__init__()
        self._page, self._places = page, {_place(folder), _place(page)}
        moved, asked = urlsplit(page), urlsplit(folder)
        self._servers = {_server(moved): moved.netloc.rpartition("@")[2], _server(asked): asked.netloc}
        self._seen: set[str] = set()
        self.found: dict[str, None] = {}

    def feed(self, data: str) -> None:
        """See `HTMLParser`. Raises PageTooLong."""
        try:
            super().feed(data)
        except AssertionError as fault:  # so it says that this is no HTML
            raise PageTooLong(f"its page of files is no HTML ({fault})") from fault
        if len(self.rawdata) > PIECE:  # what it waits for the end of; every piece would be looked through again
            raise PageTooLong(f"its page of files has a tag of more than {PIECE // 1024} KiB")

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """See `HTMLParser`. Raises PageTooLong."""
        links = {value for name, value in attrs if name == "href" and value} if tag == "a" else set()
        for link in links - self._seen:
            self._seen.add(link)
            if len(self._seen) > MAX_LINKS:
                raise PageTooLong(f"its page of files has more than {MAX_LINKS:,} links")
            with suppress(ValueError):  # it is no address
                self._keep(urlsplit(urljoin(self._page, link)))

    def _keep(self, parts: SplitResult) -> None:
        if parts.path.rpartition("/")[2] and _place(parts.geturl()) in self._places:
            # One spelling of each server, so that a file counts once; a name and password as asked with, or none.
            netloc = self._servers[_server(parts)]
            self.found[parts._replace(netloc=netloc, fragment="").geturl()] = None


def _place(address: str) -> tuple[object, ...]:
    """Server and folder of an address. Raises ValueError where its port is none."""
    parts = urlsplit(address)
    return *_server(parts), parts.path.rpartition("/")[0]


def _server(parts: SplitResult) -> tuple[str, str | None, int | None]:
    """Scheme, host and port, however they are spelt. Raises ValueError."""
    return parts.scheme, parts.hostname, PORTS.get(parts.scheme) if parts.port is None else parts.port
