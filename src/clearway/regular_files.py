"""The one door for files that are opened to be read: regular files alone, and no more of one than a limit.

What stands under a name may be a folder, a device without an end, or a pipe that nobody writes to; its size, as the
system tells it, may be 0 where there is much to read, and it may grow while it is read. Whatever is wrong leaves as an
OSError whose `strerror` says it and whose `filename` is the path.
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path

MIB = 1024**2
BLOCK_BYTES = MIB
AHEAD_BYTES = 4 * MIB  # of a file that is fetched whole; of larger ones, with pictures, little is looked at
_AT_ONCE = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
_KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}


@contextmanager
def opened(path: Path) -> Iterator[BufferedReader]:
    """A regular file, open for reading; read it through `read_at_most`, or hand it to a library that has limits.

    Raises:
        OSError: there is none, it may not be read, or is a folder (IsADirectoryError), a device, a pipe or a socket.
    """
    try:
        handle = os.open(path, os.O_RDONLY | _AT_ONCE)
    except ValueError as fault:  # a null byte in the name
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path)) from fault
    try:
        _check_kind(os.fstat(handle).st_mode, path)
    except OSError:
        os.close(handle)
        raise
    with os.fdopen(handle, "rb") as file:
        yield file


def _check_kind(mode: int, path: Path) -> None:
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.S_IFMT(mode), "something else")
        raise OSError(errno.EINVAL, f"it is {kind}, no regular file", str(path))


@contextmanager
def name_of_opened(path: Path) -> Iterator[Path]:
    """A name of a regular file, for a library that opens files itself.

    On Linux it names this very file, never another that takes its path; elsewhere it is the path, after a look.

    Raises:
        OSError: as `opened`.
    """
    with opened(path) as file:
        own = Path(f"/proc/self/fd/{file.fileno()}")
        yield own if own.exists() else path


def read_ahead(paths: Iterable[Path]) -> None:
    """Have the system fetch small files that are read soon, all at once; where it cannot, they are fetched one by one.

    Whoever reads a file tells what is wrong with it.
    """
    if not hasattr(os, "posix_fadvise"):
        return
    for path in paths:
        with suppress(OSError), opened(path) as file:
            if os.fstat(file.fileno()).st_size <= AHEAD_BYTES:
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_WILLNEED)


def read_at_most(file: BufferedReader, most_bytes: int, path: Path) -> bytes:
    """What is left to read of an open file. Raises OSError where that is more than `most_bytes`."""
    size = os.fstat(file.fileno()).st_size
    content = file.read(size + 1) if size <= most_bytes else b""
    if size < len(content) <= most_bytes:  # it has grown, or the system did not know its size
        content += file.read(most_bytes + 1 - len(content))
    if max(size, len(content)) > most_bytes:
        limit = f"{most_bytes // MIB} MiB" if most_bytes >= MIB else f"{most_bytes} bytes"
        raise OSError(errno.EFBIG, f"it is larger than {limit}", str(path))
    return content


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """What a regular file holds.

    Raises:
        OSError: as `opened`, and where it holds more than `most_bytes`.
    """
    with opened(path) as file:
        return read_at_most(file, most_bytes, path)


def read_text(path: Path, most_bytes: int, encoding: str = "utf-8") -> str:
    """The text in a regular file, with line ends as they are.

    Raises:
        OSError: see `read_bytes`.
        UnicodeDecodeError: it is no text of that encoding.
    """
    return read_bytes(path, most_bytes).decode(encoding)


def sha256_of(path: Path) -> str:
    """SHA-256 of a regular file of any size, in hexadecimal digits. Raises OSError as `opened` does."""
    with opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def blocks_of(path: Path) -> Iterator[bytes]:
    """A regular file of any size, piece by piece. Raises OSError as `opened` does."""
    with opened(path) as file:
        while block := file.read(BLOCK_BYTES):
            yield block
