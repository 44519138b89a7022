"""Files written whole or not at all, JSON read with a limit, and the user's cache folder."""

from __future__ import annotations

import errno
import json
import math
import os
import platform
import re
import shutil
import stat
import tempfile
import threading
import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from clearway.errors import ClearwayError, RunError, reason_of
from clearway.regular_files import read_text

T = TypeVar("T")
CACHE_VARIABLE = "CLEARWAY_CACHE"
PART_NAME = re.compile(r"\..+\.(?P<host>[0-9a-f]{8})-(?P<process>[0-9]+)-\w+\.part")
MAX_JSON_BYTES = 64 * 1024**2
TOLD_AFTER_S = 5.0  # of waiting for another process
_UMASK = threading.Lock()


class WaitsWarning(UserWarning):
    """Another process is at work on the same files, and this one waits for it."""


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` to write to; renamed to `path` on success, removed on any failure.

    The file reaches the disk (fsync) before it is renamed, so that a crash leaves the old file or the new one. What
    processes that were killed left unfinished in the folder is removed. Where `path` is a link, the file that it leads
    to is written. One that is there keeps its permissions.

    Raises:
        OSError: the file cannot be written, and its name is that of `path`; IsADirectoryError where `path` is a folder.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EEXIST, "is a device or a pipe, no file", str(path))
    final = path.resolve()
    final.parent.mkdir(parents=True, exist_ok=True)
    _remove_leftovers(final.parent)
    handle, name = tempfile.mkstemp(prefix=f".{final.name}.{_host()}-{os.getpid()}-", suffix=".part", dir=final.parent)
    os.close(handle)
    part = Path(name)
    try:
        with _faults_named(part, path):
            yield part
            with part.open("rb+") as file:
                os.fsync(file.fileno())
            part.chmod(stat.S_IMODE(final.stat().st_mode) if final.exists() else 0o666 & ~_umask())
            part.replace(final)
    finally:
        part.unlink(missing_ok=True)


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
    final.parent.mkdir(parents=True, exist_ok=True)
    _remove_leftovers(final.parent)
    prefix = f".{final.name}.{_host()}-{os.getpid()}-"
    try:
        part = Path(tempfile.mkdtemp(prefix=prefix, suffix=".part", dir=final.parent))
    except OSError as fault:
        raise OSError(fault.errno, os.strerror(fault.errno or 0), str(path)) from fault
    try:
        with _faults_named(part, path):
            yield part
            part.chmod(0o777 & ~_umask())
            if final.exists():
                final.rmdir()
            part.replace(final)
    finally:
        shutil.rmtree(part, ignore_errors=True)


@contextmanager
def part_folder(parent: Path) -> Iterator[Path]:
    """A temporary folder in `parent`, gone afterwards; what processes that were killed left there is removed too."""
    parent.mkdir(parents=True, exist_ok=True)
    _remove_leftovers(parent)
    part = Path(tempfile.mkdtemp(prefix=f".part.{_host()}-{os.getpid()}-", suffix=".part", dir=parent))
    try:
        yield part
    finally:
        shutil.rmtree(part, ignore_errors=True)


@contextmanager
def _faults_named(part: Path, path: Path) -> Iterator[None]:
    """Let errors of writing `part`, which name it or nothing, name `path`."""
    try:
        yield
    except OSError as fault:
        if fault.errno is None or fault.filename not in (None, str(part)):
            raise
        raise OSError(fault.errno, os.strerror(fault.errno), str(path)) from fault


def _remove_leftovers(folder: Path) -> None:
    """Remove the temporary files of processes of this machine that are no more; others may still be written to."""
    for part in folder.glob(".*.part"):
        maker = PART_NAME.fullmatch(part.name)
        if maker and maker["host"] == _host() and not _is_alive(int(maker["process"])):
            if part.is_dir() and not part.is_symlink():
                shutil.rmtree(part, ignore_errors=True)
            else:
                part.unlink(missing_ok=True)


def _host() -> str:
    """Of this machine, or container: where numbers of processes mean the same."""
    numbers = ""
    with suppress(OSError):
        numbers = os.readlink("/proc/self/ns/pid")
    return f"{zlib.crc32((platform.node() + numbers).encode()):08x}"


def _is_alive(process: int) -> bool:
    if os.name != "posix":  # elsewhere the question could end it
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _umask() -> int:
    with suppress(OSError):
        told = re.search(r"^Umask:\s*([0-7]+)$", read_text(Path("/proc/self/status"), 1024**2), re.MULTILINE)
        if told:
            return int(told[1], 8)
    with _UMASK:  # others make files while it is set: there is no other way to read it here
        mask = os.umask(0o077)
        os.umask(mask)
    return mask


def read_json(path: Path, most_bytes: int = MAX_JSON_BYTES) -> Any:
    """What a JSON file in UTF-8 holds.

    Raises:
        OSError: it cannot be read, is no regular file, or larger than `most_bytes`.
        ValueError: it is not JSON.
    """
    return parse_json(read_text(path, most_bytes))


def read_kept(path: Path, newest: int, taken: Callable[[Mapping[str, Any]], T]) -> T:
    """What `taken` takes from a JSON file that can be made again, of a format up to `newest`.

    Raises:
        RunError: the file is missing, damaged or of a newer version.
    """
    try:
        content = read_json(path)
        if int(content["format_version"]) > newest:
            raise RunError(f"{path}: written by a newer clearway. Upgrade clearway")
        return taken(content)
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise RunError(f"{path}: not readable ({reason_of(error)}). Remove it, and it is made again") from error


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
def cache_faults_named(folder: Path, kind: type[ClearwayError] = ClearwayError) -> Iterator[None]:
    """Turn what goes wrong with writing to a cache folder into one line, an error of some kind."""
    try:
        yield
    except OSError as fault:
        problem = f"the cache folder {folder} cannot be written to ({fault.strerror or fault})"
        raise kind(f"{problem}. Make room, or set {CACHE_VARIABLE} to another folder") from fault


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of `path` (a file `path`.lock beside it); others wait until it is released, and say so in time.

    The operating system frees the lock when its holder dies, so a killed process blocks nobody.
    """
    from filelock import FileLock, Timeout

    path.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(f"{path}.lock")
    try:
        lock.acquire(timeout=TOLD_AFTER_S)
    except Timeout:
        warnings.warn(f"{path.parent}: waits for another process that is at work there", WaitsWarning, stacklevel=3)
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def json_text(content: object) -> str:
    """Strict JSON, indented, with null for numbers that are not finite, and an end of line."""
    return json.dumps(_finite(content), indent=2, allow_nan=False) + "\n"


def _finite(content: object) -> object:
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
