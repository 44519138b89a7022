"""How much memory new processes can have: the machine's, or what its container or group leaves them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from clearway.regular_files import MIB, read_text

GROUPS = Path("sys/fs/cgroup")
FILES = {
    "": ("memory.max", "memory.current"),
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes"),
}
"""Limit and use of a group of version 2, and of version 1's controller of memory."""
CACHED = "inactive_file"  # of what a group uses, given back where it is needed


def free_bytes(root: Path = Path("/")) -> int | None:
    """Memory that new processes can have; None where the system does not say.

    Args:
        root: of the file system that tells it.
    """
    found = [*_of_machine(root), *_of_groups(root)]
    return max(0, min(found)) if found else None


def _of_machine(root: Path) -> Iterator[int]:
    with suppress(OSError, ValueError):
        kib = _named(root / "proc/meminfo")["MemAvailable:"]
        yield kib * 1024


def _of_groups(root: Path) -> Iterator[int]:
    """What is left of the limits of the process's control groups, of version 2 and of version 1."""
    places = {"": "", "memory": ""}  # by controller, of version 2 none
    with suppress(OSError):
        for line in _text(root / "proc/self/cgroup").splitlines():
            _, controllers, place = line.split(":", 2)
            places |= {name: place.lstrip("/") for name in controllers.split(",") if name in places}
    for name, files in FILES.items():
        top = root / GROUPS / name
        for folder in (top / places[name], *(top / places[name]).parents):
            if folder.is_relative_to(top):
                yield from _left(folder, *files)


def _left(folder: Path, limit: str, used: str) -> Iterator[int]:
    """What a group's limit leaves; nothing where it has none ("max")."""
    with suppress(OSError, ValueError):
        most, now = (int(_text(folder / name)) for name in (limit, used))
        stat = _named(folder / "memory.stat")
        yield (
            most - now + stat.get(f"total_{CACHED}", stat.get(CACHED, 0))
        )  # of version 1 the first is with what is below


def _named(path: Path) -> dict[str, int]:
    """The numbers of a file of lines such as "name 5" or "name 5 kB". Raises OSError, ValueError."""
    return {words[0]: int(words[1]) for line in _text(path).splitlines() if len(words := line.split()) > 1}


def _text(path: Path) -> str:
    """What the system tells under a name. Raises OSError, ValueError."""
    return read_text(path, MIB)
