"""Work for workers to do in tests, where they can import it; and a look at the workers of a process."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

from clearway.errors import RunError, SceneError

WORKER = b"clearway.spread.worker"


def died(part: object, how: str) -> RunError:
    return RunError(f"part {part}: its worker {how}")


def noted(folder: Path) -> Path:
    """Set up: leaves a file for each time."""
    (folder / f"set-up-{os.getpid()}-{time.monotonic_ns()}").touch()
    return folder


def no_tool() -> None:
    """Set up nothing."""


def square(tool: object, part: int) -> int:
    return part * part


def square_late(folder: Path, part: int) -> int:
    """The square; that of 0 only when another has been told."""
    while part == 0 and not (folder / "told").exists():
        time.sleep(0.01)
    (folder / "told").touch()
    return part * part


def die_once(folder: Path, part: int) -> int:
    """The square; 1 kills its worker the first time, when part 0 is under way, which ends after that."""
    if part == 0:
        (folder / "zero").touch()
        wait_for(folder / "again")
    elif not (folder / "dead").exists():
        wait_for(folder / "zero")
        (folder / "dead").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    else:
        (folder / "again").touch()
    return part * part


def die(folder: Path, part: str) -> None:
    """By SIGKILL, or with an exit code; leaves a file each time."""
    (folder / f"died-{time.monotonic_ns()}").touch()
    print("on standard output")
    print("last words", file=sys.stderr, flush=True)
    if part == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    os._exit(7)


class UnsendableError(Exception):
    """An error whose pickle cannot be read."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} and {second}")


def fail(tool: object, part: str) -> None:
    """Raise an error of a kind; "waits" does so when a test has failed by then."""
    if part == "waits":
        time.sleep(60)
        raise TimeoutError("nobody ended this")
    if part == "scene":
        raise SceneError("a.h5", "is not there", "Look for it")
    if part == "ours":
        raise ZeroDivisionError("nothing to divide by")
    raise UnsendableError("this", "that")


def variables(tool: object, names: tuple[str, ...]) -> list[str | None]:
    """Variables of the worker's environment."""
    return [os.environ.get(name) for name in names]


def wait_to_be_told(folder: Path, part: int) -> None:
    """Be under way until SIGTERM, and leave a file then."""

    def save(number: int, frame: object) -> None:
        (folder / f"saved-{part}").touch()
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, save)
    (folder / f"under-way-{part}").touch()
    while True:
        signal.pause()


def finish_when_told(folder: Path, part: int) -> int:
    """Be under way until SIGTERM, and finish then as if nothing had been."""
    told = []
    signal.signal(signal.SIGTERM, lambda number, frame: told.append(number))
    (folder / f"under-way-{part}").touch()
    while not told:
        time.sleep(0.01)
    return part


def wait_to_be_interrupted(folder: Path, part: int) -> None:
    """Be under way until Ctrl+C, and leave a file then."""
    (folder / "under-way").touch()
    try:
        while True:
            time.sleep(0.01)
    except KeyboardInterrupt:
        (folder / "saved").touch()
        raise


def wait_for(path: Path) -> None:
    """Come back when there is such a file."""
    end = time.monotonic() + 300
    while not path.exists():
        if time.monotonic() > end:
            raise TimeoutError(f"no {path}")
        time.sleep(0.01)


def workers_of(process: int) -> list[int]:
    """Running workers that a process has started."""
    found = [int(path.name) for path in Path("/proc").glob("[0-9]*")]
    return [pid for pid in found if parent_of(pid) == process and runs(pid, WORKER)]


def parent_of(pid: int) -> int | None:
    """Who started a process; None where there is no such process any more."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return None


def descends_from(pid: int | None, ancestor: int) -> bool:
    """Whether a process was started by another, or by one that that one started, and so on."""
    while pid is not None and pid > 1:
        if pid == ancestor:
            return True
        pid = parent_of(pid)
    return False


def runs(pid: int, module: bytes) -> bool:
    """It has not ended, and its command names a module."""
    try:
        return module in Path(f"/proc/{pid}/cmdline").read_bytes()  # empty for one that has ended
    except (FileNotFoundError, ProcessLookupError):
        return False


def square_slowly(folder: Path, part: int) -> int:
    """The square, after a second; leaves a file first."""
    (folder / "begun").touch()
    time.sleep(1)
    return part * part


def command_seen(tool: None, part: str) -> list[str]:
    """What this process was begun by, as a run's record tells it."""
    return sys.argv
