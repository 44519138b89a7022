"""Pages that list the files of a web server's folder are not trusted."""

import pytest

from clearway.remote import web_folder
from clearway.remote.web_folder import PIECE, FilesOfPage, PageTooLong

FOLDER = "https://host/rooms/"


def found(page: str, where: str = FOLDER) -> list[str]:
    files = FilesOfPage(FOLDER, where)
    for start in range(0, len(page), PIECE):
        files.feed(page[start : start + PIECE])
    return list(files.found)


@pytest.mark.parametrize(
    ("link", "address"),
    [
        ("a.h5", f"{FOLDER}a.h5"),
        ("./a.h5", f"{FOLDER}a.h5"),
        ("/rooms/a.h5?version=1#top", f"{FOLDER}a.h5?version=1"),
        ("https://host/rooms/a.h5", f"{FOLDER}a.h5"),
        ("HTTPS://HOST:443/rooms/a.h5", "https://host/rooms/a.h5"),
        ("a%20b.h5", f"{FOLDER}a%20b.h5"),
        ("../a.h5", None),
        ("deeper/a.h5", None),
        ("?C=N;O=D", None),
        ("http://host/rooms/a.h5", None),
        ("//other/rooms/a.h5", None),
        ("https://host:8443/rooms/a.h5", None),
        ("https://host:port/rooms/a.h5", None),
        ("file:///rooms/a.h5", None),
        ("https://[::1/a.h5", None),
    ],
)
def test_links_count_that_lead_into_the_folder_itself(link: str, address: str | None) -> None:
    assert found(f'<p><a class="file" href="{link}">a</a> <a href="{link}">again</a>') == [address] * (
        address is not None
    )


def test_a_folder_that_moved_is_followed() -> None:
    assert found('<a href="a.h5">', "https://other/new/") == ["https://other/new/a.h5"]


def test_a_name_and_password_are_for_the_folder_s_own_host() -> None:
    files = FilesOfPage("https://me:secret@host/rooms/", "https://other/rooms/")
    files.feed('<a href="a.h5"><a href="https://host/rooms/b.h5"><a href="http://host/rooms/c.h5">')
    assert list(files.found) == ["https://other/rooms/a.h5", "https://me:secret@host/rooms/b.h5"]


def test_a_file_counts_once_however_its_server_is_spelt() -> None:
    files = FilesOfPage("https://me:secret@host/rooms/", "https://q:r@other/rooms/")
    for server in ("https://other", "HTTPS://Other:443", "https://u:p@other"):
        files.feed(f'<a href="{server}/rooms/x.h5">x</a>')
    files.feed('<a href="https://other:0/rooms/y.h5">another port</a>')
    assert list(files.found) == ["https://other/rooms/x.h5"]


def test_nor_are_they_lost_where_the_same_host_is_spelt_otherwise() -> None:
    files = FilesOfPage("https://me:secret@Host/rooms/", "https://host:443/rooms/")
    files.feed('<a href="a.h5"><a href="https://hOST/rooms/b.h5"><a href="https://host:8443/rooms/c.h5">')
    assert list(files.found) == [f"https://me:secret@Host/rooms/{name}.h5" for name in "ab"]


NO_LISTS = ("<a x='", "<a/", "<!--", "<a href='", "<a b=c ", "&#", "</", "<![", "<a" + " " * 200_000)


@pytest.mark.parametrize("part", NO_LISTS, ids=lambda part: part[:10])
def test_pages_that_are_no_lists_are_refused_soon(part: str) -> None:
    page = part * (web_folder.MAX_PAGE_BYTES // len(part))
    with pytest.raises(PageTooLong, match=r"a tag of more than 64 KiB|is no HTML"):
        found(page)


def test_too_many_links_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_folder, "MAX_LINKS", 3)
    assert len(found("<a href=1><a href=2><a href=3><a href=3>")) == 3
    with pytest.raises(PageTooLong, match="more than 3 links"):
        found("<a href=1><a href=2><a href=3><a href=4>")
