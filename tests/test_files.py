"""Files written whole or not at all."""

import errno
import json
import os
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock, Timeout

from clearway import files
from clearway.errors import ClearwayError
from clearway.files import folder_written_whole, json_text, written_whole

WRITER = """
import sys; sys.path[:] = {path!r}
from pathlib import Path
from clearway.files import written_whole
with written_whole(Path({target!r})) as part:
    part.write_text("half")
    print("writing", flush=True)
    sys.stdin.read()
"""


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def writer(target: Path) -> subprocess.Popen[str]:
    """A process in the midst of writing `target`."""
    script = WRITER.format(path=sys.path, target=str(target))
    process = subprocess.Popen([sys.executable, "-c", script], stdin=-1, stdout=-1, text=True)
    assert process.stdout.readline() == "writing\n"
    return process


def test_what_fails_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(KeyError), written_whole(path) as part:
        part.write_text("new")
        raise KeyError
    assert path.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


@pytest.mark.skipif(sys.platform == "win32", reason="permissions are the system's own")
def test_a_file_keeps_its_permissions_and_a_new_one_has_the_usual(tmp_path: Path) -> None:
    path, before = tmp_path / "private.txt", os.umask(0o027)
    try:
        for mode in (0o640, 0o600):
            with written_whole(path) as part:
                part.write_text("mine")
            assert path.stat().st_mode & 0o777 == mode
            path.chmod(0o600)
    finally:
        assert os.umask(before) == 0o027


def test_unfinished_files_of_killed_processes_go_and_those_of_living_ones_stay(tmp_path: Path) -> None:
    killed, living = writer(tmp_path / "a.txt"), writer(tmp_path / "b.txt")
    assert len(names(tmp_path)) == 2
    killed.kill()
    killed.communicate()
    with written_whole(tmp_path / "c.txt") as part:
        part.write_text("whole")
    assert [name[:6] for name in names(tmp_path)] == [".b.txt", "c.txt"]
    living.communicate("")
    assert names(tmp_path) == ["b.txt", "c.txt"]
    assert (tmp_path / "b.txt").read_text() == "half"  # all that it had to write


def test_files_of_other_machines_and_programs_stay(tmp_path: Path) -> None:
    for name in (f".a.h5.00000000-{2**22 + 1}-x.part", f".a.h5.{files._host()}-{os.getpid()}-x.part", ".a.part"):
        (tmp_path / name).touch()
    before = names(tmp_path)
    with written_whole(tmp_path / "c.txt") as part:
        part.touch()
    assert names(tmp_path) == [*before, "c.txt"]


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "\ufeff{}"])
def test_what_is_no_json_is_a_value_error(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError):
        files.read_json(tmp_path / "a.json")


def test_json_too_large_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("[1, 2]")
    assert files.read_json(tmp_path / "a.json") == [1, 2]
    with pytest.raises(OSError, match="larger than"):
        files.read_json(tmp_path / "a.json", most_bytes=5)


def test_json_holds_no_number_that_json_does_not_know() -> None:
    content = {"steps": float("inf"), "rows": [(1, float("nan")), {"deep": np.float64("-inf")}], "fine": 0.5}
    assert json.loads(json_text(content), parse_constant=pytest.fail) == {
        "steps": None,
        "rows": [[1, None], {"deep": None}],
        "fine": 0.5,
    }


def test_a_folder_in_the_way_is_named_and_nothing_is_left(tmp_path: Path) -> None:
    (tmp_path / "a.h5").mkdir()
    with pytest.raises(IsADirectoryError) as caught:
        with written_whole(tmp_path / "a.h5") as part:
            part.touch()
    assert caught.value.filename == str(tmp_path / "a.h5")
    assert names(tmp_path) == ["a.h5"]


def test_a_link_stays_one_and_the_file_behind_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "link.h5").symlink_to(tmp_path / "far" / "a.h5")
    with written_whole(tmp_path / "link.h5") as part:
        part.write_text("new")
    assert (tmp_path / "link.h5").is_symlink()
    assert (tmp_path / "far" / "a.h5").read_text() == "new"


def test_devices_and_pipes_are_not_replaced_by_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="is a device or a pipe") as caught:
        with written_whole(tmp_path / "pipe") as part:
            part.touch()
    assert caught.value.filename == str(tmp_path / "pipe")
    assert (tmp_path / "pipe").is_fifo()


def test_a_full_disk_is_told_with_the_file_s_own_name(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    for named in (lambda part: None, str):
        with pytest.raises(OSError, match=r"No space left on device: '.*/a\.png'"), written_whole(path) as part:
            raise OSError(errno.ENOSPC, "Can't write (errno = 28, buf = 0x7f)", named(part))
    with pytest.raises(FileNotFoundError) as caught, written_whole(path):
        (tmp_path / "read.txt").read_text()
    assert caught.value.filename == str(tmp_path / "read.txt")


def test_a_cache_in_the_home_of_nobody_is_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", "~nobody-of-this-name/cache")
    with pytest.raises(ClearwayError, match="CLEARWAY_CACHE=~nobody-of-this-name/cache: there is no such home folder"):
        files.cache_dir()


def test_a_folder_is_there_whole_or_not_at_all(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), folder_written_whole(tmp_path / "page") as part:
        (part / "half").write_text("half")
        raise RuntimeError
    assert names(tmp_path) == []
    (tmp_path / "page").mkdir()
    with folder_written_whole(tmp_path / "page") as part:
        (part / "whole").write_text("whole")
        assert names(tmp_path / "page") == []
    assert (names(tmp_path), names(tmp_path / "page")) == (["page"], ["whole"])
    for taken in (tmp_path / "page", tmp_path / "page/whole"):
        with pytest.raises(ClearwayError, match="no empty folder"), folder_written_whole(taken):
            raise AssertionError("never begun")


def test_a_folder_that_cannot_be_made_is_named_as_it_was_asked_for(tmp_path: Path, monkeypatch) -> None:
    def refuse(**where):
        raise OSError(errno.EROFS, "no", str(tmp_path / ".page.part"))

    monkeypatch.setattr(files.tempfile, "mkdtemp", refuse)
    with pytest.raises(OSError) as refused, folder_written_whole(tmp_path / "page"):
        raise AssertionError("never begun")
    assert refused.value.filename == str(tmp_path / "page")


def test_an_unfinished_folder_of_a_killed_process_goes(tmp_path: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    left = tmp_path / f".page.{files._host()}-{dead.pid}-x.part"
    left.mkdir()
    (left / "half").touch()
    with folder_written_whole(tmp_path / "other") as part:
        (part / "whole").touch()
    assert names(tmp_path) == ["other"]


def test_who_waits_for_another_process_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "TOLD_AFTER_S", 0.01)
    other = FileLock(tmp_path / "set.lock", thread_local=False)
    other.acquire()
    anyway = threading.Timer(5, other.release)
    told = []

    def let_go(text: str, *_: object, **__: object) -> None:
        told.append(text)
        other.release()

    monkeypatch.setattr(warnings, "warn", let_go)
    anyway.start()
    with files.locked(tmp_path / "set"):
        assert told == [f"{tmp_path}: waits for another process that is at work there"]
    anyway.cancel()


def test_who_need_not_wait_says_nothing(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    with files.locked(tmp_path / "new" / "set"), pytest.raises(Timeout):
        FileLock(tmp_path / "new" / "set.lock").acquire(timeout=0)
    FileLock(tmp_path / "new" / "set.lock").acquire(timeout=0)
    assert not recwarn.list
