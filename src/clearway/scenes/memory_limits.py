"""How much memory reading a file may take, whatever the file says of itself; checked before anything is read."""

from __future__ import annotations

from pathlib import Path

from clearway.remote.address import file_bytes

MIB = 1024**2
BASE_BYTES = 512 * MIB
BYTES_PER_FILE_BYTE = 200
MOST_BYTES = 8 * 1024 * MIB
COPIES = 4  # of an array that may be in memory at once: as it was read, converted, and masks of what is wrong in it


def memory_limit(file_bytes: int) -> int:
    """Bytes by which reading a file of so many bytes may let the process grow."""
    return min(MOST_BYTES, BASE_BYTES + BYTES_PER_FILE_BYTE * file_bytes)


def array_limit(path: Path) -> int:
    """Most bytes of a file's values that are held at once. Raises OSError where there is no such file."""
    return memory_limit(file_bytes(path)) // COPIES
