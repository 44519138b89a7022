"""The wall clock may jump: nothing is decided by it but what stands here, and why that may be."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import clearway

SOURCE = Path(clearway.__file__).parent
WALL = {"time", "time_ns", "now", "utcnow", "today", "gmtime", "localtime", "ctime", "strftime", "utime"}
OF_CLOCKS = {"time", "datetime", "date", "os"}  # the modules and types that these are called on
OF_FILES = {"st_mtime", "st_mtime_ns", "st_ctime", "st_atime", "getmtime"}
KNOWN = {
    ("serve/access_log.py", "datetime.now"): "a line says when it was written",
    ("learn/run_record.py", "datetime.now"): "a record says when its run was begun",
    ("learn/tracking.py", "time.time"): "where TensorBoard draws a run on its axis of days",
    ("scenes/file_pictures.py", "st_mtime_ns"): "held against the one before, as equal or not",
    ("experiments/jobs.py", "st_mtime_ns"): "held against the one before, as equal or not",
    ("remote/address.py", "st_mtime_ns"): "held against a constant that a whole copy is marked with, as equal or not",
    ("remote/cache.py", "os.utime"): "which file goes first from a full cache; those that are kept stay",
    ("remote/cache.py", "st_mtime"): "which file goes first from a full cache; those that are kept stay",
    ("remote/passing.py", "os.utime"): "which file goes first from a full cache; it is fetched again",
}


def wall_clocks(source: str) -> list[str]:
    """What a module asks of the wall clock, and of the times of files."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and node.attr in OF_FILES:
            found.append(node.attr)
        elif isinstance(node, ast.Attribute) and node.attr in WALL:
            owner = ast.unparse(node.value).split(".")[-1]
            found += [f"{owner}.{node.attr}"] if owner in OF_CLOCKS else []
        elif isinstance(node, ast.ImportFrom) and node.module == "time":
            found += [f"time.{name.name}" for name in node.names if name.name in WALL]
    return found


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("import time\ndeadline = time.time() + 3", ["time.time"]),
        ("def ask(clock=time.time): ...", ["time.time"]),
        ("from time import time, monotonic", ["time.time"]),
        ("datetime.datetime.now(UTC)", ["datetime.now"]),
        ("old = path.stat().st_mtime", ["st_mtime"]),
        ("time.monotonic(); time.perf_counter(); loop.time()", []),
    ],
)
def test_what_asks_the_wall_clock_is_found(source, expected) -> None:
    assert wall_clocks(source) == expected


def test_nothing_else_is_decided_by_the_wall_clock() -> None:
    found = {
        (path.relative_to(SOURCE).as_posix(), asked)
        for path in SOURCE.rglob("*.py")
        for asked in wall_clocks(path.read_text(encoding="utf-8"))
    }
    assert found == set(KNOWN), "take time.monotonic, or say here why the wall clock may jump"
