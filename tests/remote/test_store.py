"""What is said of servers that fail, and how soon."""

import gc
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Barrier

import pytest

from clearway.errors import ClearwayError, install_hint
from clearway.remote import store
from clearway.remote.cache import fetched
from clearway.remote.records import RECORDS
from helpers.servers_of_files import (
    CutShort,
    Failing,
    GoogleStore,
    Meeting,
    Shrunk,
    Trickling,
    Unwilling,
    files_of,
    silent_server,
    web_server,
)

SUFFIXES = (".h5",)


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(store, "PAUSE_S", 0.02)
    yield
    left = [path for path in (tmp_path / "cache/remote").glob("*") if not path.name.startswith(".")]
    assert all((path.parent / RECORDS / path.name).exists() for path in left)
    assert not list((tmp_path / "cache/remote").glob("*.part"))


def told(address: str) -> str:
    """What is said of an address, without the address."""
    with pytest.raises(ClearwayError) as caught:
        fetched([address], SUFFIXES)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"{address}: ")
    return str(caught.value).removeprefix(f"{address}: ")


def test_what_is_not_there(s3: Callable[[str, bytes], None], tmp_path: Path) -> None:
    s3("a/b.txt", b"no scene")
    assert told("s3://no-such-bucket/a") == "there is nothing there. Check the address"
    assert told("s3://no-such-bucket/a.h5") == "there is nothing there. Check the address"
    assert told("s3://rooms/a/c.h5") == "there is nothing there. Check the address"
    assert told("s3://rooms/a") == "no file ending in .h5 there. Check the address"
    with web_server(files_of(tmp_path)) as address:
        assert told(f"{address}/c.h5") == "there is nothing there. Check the address"
        assert told(f"{address}/c") == "there is nothing there. Check the address"
    assert told(f"{address}/c.h5").startswith("cannot be reached or read (Cannot connect to host 127.0.0.1")


def test_without_credentials(s3: Callable[[str, bytes], None], monkeypatch: pytest.MonkeyPatch) -> None:
    from s3fs import S3FileSystem

    S3FileSystem.clear_instance_cache()
    monkeypatch.delenv("AWS_ACCESS_KEY_ID")
    monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", "/nowhere")
    assert told("s3://rooms/a.h5").startswith("may not be opened (Unable to locate credentials). Check the credentials")


@pytest.mark.parametrize("scheme", ["http", "s3"])
def test_a_server_that_says_nothing_is_given_up(
    scheme: str, s3: Callable[[str, bytes], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    from s3fs import S3FileSystem

    S3FileSystem.clear_instance_cache()
    monkeypatch.setattr(store, "SILENCE_S", 0.2)
    with silent_server() as address:
        monkeypatch.setenv("AWS_ENDPOINT_URL", address)
        began = time.monotonic()
        said = told("s3://rooms/a" if scheme == "s3" else f"{address}/a.h5")
    assert time.monotonic() - began < 5
    assert said.startswith("no answer in ")


def test_a_question_is_given_up_after_a_time_whatever_the_library_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "ANSWER_S", 0.3)
    with silent_server() as address:
        assert told(f"{address}/a.h5") == "no answer in 0 s. Check the network and the server, then try again"


@pytest.mark.parametrize("handler", [CutShort, Shrunk])
def test_half_a_file_is_none(handler: type[CutShort], tmp_path: Path) -> None:
    with web_server(handler) as address:
        said = told(f"{address}/a.h5")
    assert "payload is not completed" in said if handler is CutShort else said.startswith("4 of 10 bytes came")
    assert not list((tmp_path / "cache/remote").rglob("a.h5"))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("200.h5", "its server does not say how large it is"),
        ("400.h5", r"cannot be reached or read \(400, message='Bad Request', url=.http://127.0.0.1:\d+/400.h5.\)"),
        ("403.h5", r"may not be opened \(403, message='Forbidden'"),
        ("404.h5", "there is nothing there"),
        ("200", "no file ending in .h5 there"),
    ],
)
def test_secrets_are_not_told(name: str, expected: str) -> None:
    with web_server(Unwilling) as address, pytest.raises(ClearwayError, match=expected) as caught:
        fetched([f"{address.replace('://', '://me:secret@')}/{name}?signature=secret&more=it's%20secret"], SUFFIXES)
    assert "secret" not in str(caught.value)
    assert str(caught.value).startswith(f"{address}/{name}: ")


@pytest.mark.parametrize("name", ["a.h5", "a"])
def test_secrets_are_not_told_by_a_server_that_is_not_there(name: str) -> None:
    with silent_server() as address:
        pass
    with pytest.raises(ClearwayError, match="Cannot connect to host") as caught:
        fetched([f"{address}/{name}?signature=secret"], SUFFIXES)
    assert "secret" not in str(caught.value)


def test_a_folder_is_named_without_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    there = store.Store("http://127.0.0.1/")
    monkeypatch.setattr(store.Store, "_ask", lambda *_: {"type": "directory"})
    with pytest.raises(ClearwayError, match=r"^http://127.0.0.1/a.h5: a folder, expected a file"):
        there.file("http://me:secret@127.0.0.1/a.h5?signature=secret")


@pytest.mark.parametrize("failure", [503, 429, 500, "cut off", "silent"])
@pytest.mark.parametrize("of", ["question", "download"])
def test_what_fails_for_the_moment_is_tried_again(
    of: str, failure: int | str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "SILENCE_S", 0.5)  # a busy machine may answer late, too
    (tmp_path / "a.h5").write_bytes(b"there")
    asked, counts = [], {"question": 4, "download": 2}  # a question is two requests, HEAD and then GET
    handler = type(
        "Twice",
        (Failing,),
        {
            "failures": [failure] * counts[of],
            "asked": asked,
            "methods": ("GET",) if of == "download" else ("GET", "HEAD"),
        },
    )
    with web_server(files_of(tmp_path, handler)) as address:
        (path,) = fetched([f"{address}/a.h5"], SUFFIXES)
    assert path.read_bytes() == b"there"
    assert asked.count("GET") == 3


@pytest.mark.parametrize(("failure", "tries"), [(503, store.TRIES), (400, 1), (416, 1)])
@pytest.mark.parametrize("scheme", ["http", "s3"])
def test_tries_are_not_multiplied(
    scheme: str,
    failure: int,
    tries: int,
    s3: Callable[[str, bytes], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from s3fs import S3FileSystem

    S3FileSystem.clear_instance_cache()
    asked: list[str] = []
    handler = type("Always", (Failing,), {"failures": [failure] * 20, "asked": asked})
    with web_server(files_of(tmp_path, handler)) as address:
        monkeypatch.setenv("AWS_ENDPOINT_URL", address)
        file = store.RemoteFile("s3://rooms/a.h5" if scheme == "s3" else f"{address}/a.h5", 1, "")
        with pytest.raises(ClearwayError):
            store.Store(file.address).download(file, tmp_path / "a.h5")
    assert asked == ["GET"] * tries


def test_files_of_a_folder_are_asked_about_together(tmp_path: Path) -> None:
    for number in range(4):
        (tmp_path / f"{number}.h5").write_bytes(b"there")
    four = Barrier(4, timeout=60)
    handler = type("Four", (Meeting,), {"expected": four, "left": 4})
    with web_server(files_of(tmp_path, handler)) as address:
        assert [path.name for path in fetched([address], SUFFIXES)] == [f"{number}.h5" for number in range(4)]
    assert not four.broken


def threads_of_pools() -> list[str]:
    return [thread.name for thread in threading.enumerate() if "ThreadPoolExecutor" in thread.name]


def test_a_file_that_fails_ends_the_others(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with web_server(Trickling) as address:
        began = time.monotonic()
        with pytest.raises(ClearwayError, match="payload is not completed"):
            fetched([f"{address}/slow.h5", f"{address}/b.h5"], SUFFIXES)
        assert time.monotonic() - began < 2
    assert not threads_of_pools()
    assert capfd.readouterr().err == ""


@pytest.mark.slow
@pytest.mark.parametrize("server", ["silent", "slow"])
def test_ctrl_c_ends_what_is_under_way(
    server: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    pressed: list[float] = []

    def press() -> None:
        if not pressed:
            pressed.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(store, "SILENCE_S", 6)
    monkeypatch.setattr(Trickling, "on_first_byte", staticmethod(press))
    later = threading.Timer(0.3, press)
    with web_server(Trickling) if server == "slow" else silent_server() as address:
        if server == "silent":
            later.start()
        with pytest.raises(KeyboardInterrupt):
            fetched([f"{address}/slow.h5"], SUFFIXES)
        later.cancel()
        assert time.monotonic() - pressed[0] < 1.5
    assert not threads_of_pools()
    gc.collect()  # what was left open is told of then
    assert capfd.readouterr().err == ""
    assert not caplog.records


def test_a_large_file_comes_in_one_stream(
    s3: Callable[[str, bytes], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten parts of 50 MB of each of sixteen files would be 8 GB of memory."""
    from s3fs import S3FileSystem

    monkeypatch.setattr(S3FileSystem, "default_block_size", 1000)
    monkeypatch.setattr(S3FileSystem, "_download_file_part_concurrent", None)
    s3("a.h5", bytes(5000))
    assert fetched(["s3://rooms/a.h5"], SUFFIXES)[0].stat().st_size == 5000


def test_google_s_store(monkeypatch: pytest.MonkeyPatch) -> None:
    GoogleStore.objects = {"a/1.h5": b"one", "a/2.h5": b"two", "a/no.txt": b"no"}
    with web_server(GoogleStore) as address:
        monkeypatch.setenv("STORAGE_EMULATOR_HOST", address)
        paths = fetched(["gs://rooms/a", "gs://rooms/a/2.h5"], SUFFIXES)
    assert [path.read_bytes() for path in paths] == [b"one", b"two", b"two"]


@pytest.mark.slow
def test_google_s_package_begins_a_download_anew_that_broke_off(monkeypatch: pytest.MonkeyPatch) -> None:
    GoogleStore.objects = {"a/1.h5": b"x" * 300_000}
    monkeypatch.setattr(GoogleStore, "cuts", 2)
    with web_server(GoogleStore) as address:
        monkeypatch.setenv("STORAGE_EMULATOR_HOST", address)
        (path,) = fetched(["gs://rooms/a/1.h5"], SUFFIXES)
    assert path.read_bytes() == b"x" * 300_000 and GoogleStore.cuts == 0


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "aiohttp", None)
    needs = f"https:// needs another package. {install_hint('https')}"
    assert told("https://127.0.0.1/a.h5") == needs
    with pytest.raises(ClearwayError) as caught:
        fetched(["https://127.0.0.1/a.h5?signature=secret"], SUFFIXES)
    assert str(caught.value) == f"https://127.0.0.1/a.h5: {needs}"


def test_a_version_is_the_best_that_a_server_tells_alone() -> None:
    """Some stores list milliseconds, and tell seconds of a file."""
    assert store._version({"ETag": "a", "LastModified": "12.345"}) == store._version(
        {"ETag": "a", "LastModified": "12"}
    )
    assert store._version({"LastModified": "12"}) == "12"
    assert store._version({"ETag": None}) == ""
