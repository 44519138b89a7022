"""Files written whole or not at all, JSON read with a limit, and the user's cache folder."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.errors import ClearwayError
from clearway.regular_files import read_text

if TYPE_CHECKING:
    from filelock import BaseFileLock

CACHE_VARIABLE = "CLEARWAY_CACHE"
PART_NAME = re.compile(r"\..+\.\w{8}\.part")
PART_LOCK = ".clearway.lock"
TRIES = 3  # for a folder of one's own, which another process may take for a leftover until it is locked
MAX_JSON_BYTES = 64 * 1024**2


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` to write to; renamed to `path` on success, removed on any failure.

    The file reaches the disk (fsync) before it is renamed, so that a crash leaves the old file or the new one. What
    processes that were killed left unfinished in the folder is removed. Where `path` is a link, the file that it leads
    to is written.

    Raises:
        OSError: the file cannot be written, and its name is that of `path`; IsADirectoryError where `path` is a folder.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EEXIST, "is a device or a pipe, no file", str(path))
    final = path.resolve()
    with _part_of(final, path) as part, _faults_named(part, path):
        part.touch(0o600)
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        part.chmod(0o666 & ~_umask())
        part.replace(final)


def check_free(folder: Path) -> None:
    """Raise ClearwayError where there is something already, other than an empty folder."""
    if folder.is_symlink() or (folder.exists() and (not folder.is_dir() or any(folder.iterdir()))):
        raise ClearwayError(f"{folder}: exists and is no empty folder. Give another one, or remove it")


@contextmanager
def folder_written_whole(path: Path) -> Iterator[Path]:
    """A temporary folder beside `path` to write into; it becomes `path` on success, and is removed on any failure.

    What processes that were killed left unfinished beside it is removed.

    Raises:
        ClearwayError: `path` is there and is no empty folder.
        OSError: the folder cannot be made.
    """
    check_free(path)
    final = path.resolve()
    with _part_of(final, path) as part, _faults_named(part, path):
        part.mkdir(0o700)
        yield part
        part.chmod(0o777 & ~_umask())
        if final.exists():
            final.rmdir()
        part.replace(final)


@contextmanager
def part_folder(parent: Path) -> Iterator[Path]:
    """A temporary folder in `parent`, gone afterwards; what processes that were killed left there is removed too."""
    with _part_of(parent / "part", parent) as part:
        part.mkdir(0o700)
        yield part


@contextmanager
def _part_of(final: Path, path: Path) -> Iterator[Path]:
    """Where to make what is to become `final`, a path beside it that is not there yet and is gone afterwards.

    It is in a folder of its own with a lock, which the system frees when this process ends.

    Raises:
        OSError: such a folder cannot be made; its name is that of `path`.
    """
    final.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(final.parent)
    try:
        folder, lock = _locked_folder(final)
    except OSError as fault:
        raise OSError(fault.errno, os.strerror(fault.errno or 0), str(path)) from fault
    try:
        yield folder / final.name
    finally:
        lock.release()  # before: Windows removes no open file
        shutil.rmtree(folder, ignore_errors=True)


def _locked_folder(final: Path) -> tuple[Path, BaseFileLock]:
    """A new folder beside `final`, and its lock, which is held where the file system has locks."""
    from filelock import FileLock

    def new() -> tuple[Path, BaseFileLock]:
        folder = Path(tempfile.mkdtemp(prefix=f".{final.name}.", suffix=".part", dir=final.parent))
        return folder, FileLock(folder / PART_LOCK, timeout=0)

    for _ in range(TRIES):
        folder, lock = new()
        with suppress(OSError, NotImplementedError):  # taken for a leftover before it was locked; or no locks are here
            lock.acquire()
            if (folder / PART_LOCK).exists():
                return folder, lock
        lock.release()
        shutil.rmtree(folder, ignore_errors=True)
    return new()  # where there are no locks, nobody takes it for a leftover


@contextmanager
def _faults_named(part: Path, path: Path) -> Iterator[None]:
    """Let errors of writing `part`, which name it or nothing, name `path`."""
    try:
        yield
    except OSError as fault:
        if fault.errno is None or fault.filename not in (None, str(part)):
            raise
        raise OSError(fault.errno, os.strerror(fault.errno), str(path)) from fault


def remove_leftovers(folder: Path) -> None:
    """Remove what processes that were killed left unfinished in a folder; what living ones write stays.

    Whether its maker lives is told by its lock, also where that is in another container or on another machine.
    """
    for part in folder.glob(".*.part"):
        if PART_NAME.fullmatch(part.name) and part.is_dir() and not part.is_symlink():
            with suppress(OSError, NotImplementedError):  # it is held, gone, another user's, or there are no locks
                _remove_unless_held(part)


def _remove_unless_held(part: Path) -> None:
    """Remove what has a lock that can be had, or is empty: it was about to have one. Raises OSError where it cannot."""
    from filelock import FileLock

    if (part / PART_LOCK).exists() or not any(part.iterdir()):  # else another program's
        with FileLock(part / PART_LOCK, timeout=0):
            shutil.rmtree(part, ignore_errors=True)
        part.rmdir()  # is left by Windows, which removes no open file


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def read_json(path: Path, most_bytes: int = MAX_JSON_BYTES) -> Any:
    """What a JSON file in UTF-8 holds.

    Raises:
        OSError: it cannot be read, is no regular file, or larger than `most_bytes`.
        ValueError: it is not JSON.
    """
    return parse_json(read_text(path, most_bytes))


def parse_json(text: str) -> Any:
    """What a text of JSON says. Raises ValueError where it says nothing, or is nested too deep."""
    try:
        return json.loads(text)
    except RecursionError as fault:
        raise ValueError("it is nested too deep") from fault


def safetensors_metadata(content: bytes) -> dict[str, Any]:
    """The texts by name that stand in the header of a safetensors file.

    Raises:
        ValueError, KeyError, TypeError: it has no such header.
    """
    length = int.from_bytes(content[:8], "little")
    if len(content) < 8 or length > len(content) - 8:
        raise ValueError("its header is cut off")
    return dict(parse_json(content[8 : 8 + length].decode())["__metadata__"])


def cache_dir() -> Path:
    """The folder for what can be made again: `$CLEARWAY_CACHE`, else the user's cache folder.

    Raises:
        ClearwayError: the variable names the home folder of nobody.
    """
    from platformdirs import user_cache_path

    chosen = os.environ.get(CACHE_VARIABLE)
    if not chosen:
        return user_cache_path("clearway", appauthor=False)
    try:
        return Path(chosen).expanduser()
    except RuntimeError as fault:
        raise ClearwayError(f"{CACHE_VARIABLE}={chosen}: there is no such home folder. Set it to a folder") from fault


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of `path` (a file `path`.lock beside it); others wait until it is released.

    The operating system frees the lock when its holder dies, so a killed process blocks nobody.
    """
    from filelock import FileLock

    path.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(f"{path}.lock"):
        yield


def json_text(content: object) -> str:
    """Strict JSON, indented, with null for numbers that are not finite, and an end of line."""
    return json.dumps(_finite(content), indent=2, allow_nan=False) + "\n"


def _finite(content: object) -> object:
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
