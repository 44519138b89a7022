"""Files from elsewhere, kept within a limit."""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from clearway.errors import ClearwayError
from clearway.remote import leases
from clearway.remote.address import fetched_folder
from clearway.remote.cache import LIMIT_VARIABLE, CacheWarning, fetched
from clearway.remote.records import RECORDS, origin
from clearway.remote.store import Store
from helpers.servers_of_files import Dateless, files_of, web_server

SUFFIXES = (".h5",)


@pytest.fixture
def web(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A web server with files of 1,000 bytes, and an empty cache; yields its address."""
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    (tmp_path / "web").mkdir()
    for name in "abcde":
        (tmp_path / f"web/{name}.h5").write_bytes(name.encode() * 1000)
    with web_server(files_of(tmp_path / "web")) as address:
        yield address


def end_process() -> None:
    """Give this process's lease back, as its end would."""
    leases.lease_of(fetched_folder()).end()
    leases._made.cache_clear()


def kept() -> str:
    """Names of the files in the cache."""
    return "".join(sorted(path.stem for path in fetched_folder().rglob("*.h5")))


def no_download(*_: object) -> None:
    raise AssertionError("is there already")


def test_a_folder_s_files_come_in_order_and_once(web: str, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = fetched([web, f"{web}/b.h5"], SUFFIXES)
    assert [path.name for path in paths] == ["a.h5", "b.h5", "c.h5", "d.h5", "e.h5", "b.h5"]
    assert paths[2].read_bytes() == b"c" * 1000
    assert origin(paths[2]) == f"{web}/c.h5"
    monkeypatch.setattr(Store, "download", no_download)
    assert fetched([web], SUFFIXES) == paths[:5]


def test_another_content_is_another_file(s3: Callable[[str, bytes], None]) -> None:
    s3("a.h5", b"before")
    (before,) = fetched(["s3://rooms/a.h5"], SUFFIXES)
    s3("a.h5", b"after.")
    (after,) = fetched(["s3://rooms/a.h5"], SUFFIXES)
    assert (before.read_bytes(), after.read_bytes()) == (b"before", b"after.")


def test_a_copy_of_which_the_server_tells_no_version_is_told_of(tmp_path: Path, web: str) -> None:
    with web_server(files_of(tmp_path / "web", Dateless)) as address:
        (path,) = fetched([f"{address}/a.h5"], SUFFIXES)
        with pytest.warns(CacheWarning, match=rf"a\.h5: its server tells no version .* Remove {path.parent} to fetch"):
            assert fetched([f"{address}/a.h5"], SUFFIXES) == [path]


def test_a_damaged_copy_is_fetched_again(web: str) -> None:
    (path,) = fetched([f"{web}/a.h5"], SUFFIXES)
    path.write_bytes(b"a")
    assert fetched([f"{web}/a.h5"], SUFFIXES)[0].read_bytes() == b"a" * 1000


def test_the_least_recently_used_goes_first(web: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT_VARIABLE, "3.5e-6")
    for name in "abcab":
        fetched([f"{web}/{name}.h5"], SUFFIXES)
        end_process()
    assert kept() == "abc"
    fetched([f"{web}/d.h5"], SUFFIXES)
    assert kept() == "abd"
    end_process()


@pytest.mark.parametrize("jump_s", [-1e9, 1e9])
def test_a_clock_that_jumps_takes_nothing_from_who_uses_it(
    web: str, jump_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which files go first depends on it, and no more: they are fetched again."""
    monkeypatch.setenv(LIMIT_VARIABLE, "2.5e-6")
    for name in "ab":
        fetched([f"{web}/{name}.h5"], SUFFIXES)
        end_process()
    for path in fetched_folder().rglob("*.h5"):
        used_s = path.parent.stat().st_mtime + jump_s
        os.utime(path.parent, (used_s, used_s))
    in_use, also = fetched([f"{web}/a.h5", f"{web}/c.h5"], SUFFIXES)
    assert (kept(), in_use.read_bytes(), also.read_bytes()) == ("ac", b"a" * 1000, b"c" * 1000)
    end_process()
    assert fetched([f"{web}/b.h5"], SUFFIXES)[0].read_bytes() == b"b" * 1000
    end_process()


def test_what_another_process_has_fetched_stays(web: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT_VARIABLE, "2.5e-6")
    fetched([f"{web}/a.h5", f"{web}/b.h5"], SUFFIXES)
    other = leases.lease_of(fetched_folder())  # as if of another process
    leases._made.cache_clear()
    with pytest.raises(ClearwayError, match=r"1e-06 GB are to be kept here, 2e-06 GB by others .* is 2.5e-06 GB"):
        fetched([f"{web}/c.h5"], SUFFIXES)
    assert kept() == "ab"
    end_process()
    other.lock.release()  # as the system does when a process is killed
    fetched([f"{web}/c.h5"], SUFFIXES)
    assert kept() in ("ac", "bc")  # those two came together
    assert not other.path.exists()
    end_process()


def test_what_was_refused_is_not_kept(web: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT_VARIABLE, "2.5e-6")
    fetched([f"{web}/a.h5"], SUFFIXES)
    with pytest.raises(ClearwayError, match="5e-06 GB are to be kept here"):
        fetched([web], SUFFIXES)
    assert [path.name for path in fetched([f"{web}/a.h5", f"{web}/e.h5"], SUFFIXES)] == ["a.h5", "e.h5"]
    end_process()


def test_who_emptied_the_cache_has_taken_no_lease(web: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT_VARIABLE, "2.5e-6")
    fetched([f"{web}/a.h5"], SUFFIXES)
    shutil.rmtree(fetched_folder())
    fetched([f"{web}/b.h5"], SUFFIXES)
    mine = leases.lease_of(fetched_folder())
    leases._made.cache_clear()  # as if of another process
    with pytest.raises(ClearwayError, match="are to be kept here"):
        fetched([f"{web}/c.h5", f"{web}/d.h5"], SUFFIXES)
    assert kept() == "b"
    end_process()
    mine.end()


@pytest.mark.parametrize("damage", [b"e3b0c44298fc1c14", b"\xff\xfe", b"0" * 32 + b"-1\n../../elsewhere-5\n"])
def test_a_damaged_lease_ends_nobody(damage: bytes, web: str) -> None:
    fetched([f"{web}/a.h5"], SUFFIXES)
    mine = leases.lease_of(fetched_folder())
    mine.path.write_bytes(damage)
    leases._made.cache_clear()  # as if of another process
    fetched([f"{web}/b.h5"], SUFFIXES)
    assert kept() == "ab"
    end_process()
    mine.end()


def test_a_record_is_written_to_no_file_that_a_link_leads_to(web: str, tmp_path: Path) -> None:
    (records := fetched_folder() / RECORDS).mkdir(parents=True)
    (tmp_path / "mine").write_text("mine")
    (records / ".part").symlink_to(tmp_path / "mine")
    fetched([f"{web}/a.h5"], SUFFIXES)
    assert (tmp_path / "mine").read_text() == "mine"
    end_process()


@pytest.mark.parametrize("words", ["much", "0", "-1", "nan"])
def test_a_limit_that_is_none(words: str, web: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LIMIT_VARIABLE, words)
    with pytest.raises(ClearwayError, match=rf"^{LIMIT_VARIABLE}={words}: expected a number of gigabytes"):
        fetched([f"{web}/a.h5"], SUFFIXES)


def test_a_cache_that_cannot_be_written(web: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "file"))
    with pytest.raises(ClearwayError, match=r"cannot be written to \(Not a directory\)"):
        fetched([f"{web}/a.h5"], SUFFIXES)


def test_a_killed_process_leaves_nothing(web: str) -> None:
    part = fetched_folder() / f".part.{cache_host()}-{2**22 + 1}-x.part"
    part.mkdir(parents=True)
    fetched([f"{web}/a.h5"], SUFFIXES)
    assert not part.exists()


def cache_host() -> str:
    from clearway.files import _host

    return _host()
