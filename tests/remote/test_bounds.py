"""A server of files is not trusted: what it says of them is held against what it sends."""

import asyncio
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
from yarl import URL

from clearway.errors import ClearwayError
from clearway.remote import bounds, store, web_folder
from clearway.remote.address import fetched_folder
from clearway.remote.cache import fetched
from clearway.remote.store import RemoteFile
from helpers.servers_of_files import Endless, Trickling, files_of, web_server


@pytest.fixture(autouse=True)
def _empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def endless() -> Iterator[str]:
    with web_server(Endless) as address:
        yield address


def test_no_more_comes_than_was_said(endless: str) -> None:
    with pytest.raises(ClearwayError, match=r"a\.h5: .*more bytes come than its server says that it has"):
        fetched([f"{endless}/a.h5"], [".h5"])
    assert not list(fetched_folder().rglob("*.h5"))


def test_a_page_without_end_is_not_read_to_its_end(endless: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_folder, "MAX_PAGE_BYTES", 1024**2)
    with pytest.raises(ClearwayError, match="its page of files is larger than 1 MiB"):
        fetched([f"{endless}/set"], [".h5"])


def test_who_hardly_sends_anything_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "SLOW_S", 1)
    with web_server(Trickling) as address, pytest.raises(ClearwayError, match="fewer than 1,000 bytes a second came"):
        fetched([f"{address}/slow.h5"], [".h5"])


@pytest.mark.parametrize("name", ["a\0b.h5", "a\nb.h5", "a\x1b[2Jb.h5", "a\\b.h5", "b" * 200 + ".h5"])
def test_names_that_no_file_here_may_have(name: str) -> None:
    with pytest.raises(ClearwayError, match="Rename it there"):
        RemoteFile(f"s3://rooms/{name}", 1, "")


def test_names_may_be_of_any_language() -> None:
    assert RemoteFile("https://host/k%C3%BCche.h5", 0, "").name == "küche.h5"


@pytest.mark.parametrize("size", [-5, 10**25])
def test_sizes_that_no_file_has(size: int) -> None:
    with pytest.raises(ClearwayError, match="its server says that it has"):
        RemoteFile("s3://rooms/a.h5", size, "")


@pytest.mark.parametrize("header", ["Location", "URI"])
@pytest.mark.parametrize(
    ("first", "then", "followed"),
    [
        ("https://host/a.h5", "http://host/a.h5", False),
        ("https://host/a.h5", "//other/a.h5", True),
        ("https://host/a.h5", "/b.h5", True),
        ("http://host/a.h5", "http://other/a.h5", True),
        ("http://host/a.h5", "https://host/a.h5", True),
    ],
)
def test_https_is_not_left(first: str, then: str, followed: bool, header: str) -> None:
    (look,) = store._options("https")["client_kwargs"]["trace_configs"][0].on_request_redirect
    step = SimpleNamespace(url=URL(first), response=SimpleNamespace(headers={header: then}))
    with nullcontext() if followed else pytest.raises(OSError, match="from https to http"):
        asyncio.run(look(None, None, step))


@pytest.mark.parametrize("kind", ["file", "link"])
def test_what_lies_in_place_of_an_entry_goes(kind: str, tmp_path: Path) -> None:
    (tmp_path / "web").mkdir()
    (tmp_path / "web/a.h5").write_bytes(b"a")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/a.h5").write_bytes(b"mine")
    with web_server(files_of(tmp_path / "web")) as address:
        (path,) = fetched([f"{address}/a.h5"], [".h5"])
        path.unlink()
        path.parent.rmdir()
        path.parent.write_text("") if kind == "file" else path.parent.symlink_to(tmp_path / "mine")
        assert fetched([f"{address}/a.h5"], [".h5"]) == [path]
    assert path.read_bytes() == b"a" and not path.parent.is_symlink()
    assert (tmp_path / "mine/a.h5").read_bytes() == b"mine"
