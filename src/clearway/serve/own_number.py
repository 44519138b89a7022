"""A folder that replicas share which nobody has started together: each holds a number in it as long as it lives."""

from __future__ import annotations

import fcntl
import mmap
import os
import secrets
import shutil
import time
from array import array
from ctypes import c_double
from pathlib import Path
from typing import Any

from clearway.errors import DeployError
from clearway.regular_files import read_bytes
from clearway.serve.replica import Beats

MAX_BEATS_BYTES = 1 << 16
SPARED_S = 3600.0  # after the last beat there, for which a folder is kept: its replicas may just be restarted


def own_number(folder: Path, most: int) -> int:
    """The first number that no other process holds; this one does until it ends, however that ends.

    The file of the number says which process holds it. It beats at once, as not ready.

    Args:
        folder: that is shared; it is made where there is none.
        most: numbers there are.

    Raises:
        DeployError: all are held.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for number in range(most):
        if (held := _locked(folder / f"{number}.number")) is not None:
            os.truncate(held, 0)
            os.write(held, str(os.getpid()).encode())
            beats_in(folder, most).beat(number, False)
            return number
    raise DeployError(f"{folder}: {most} replicas run there already. End some of them")


def beats_in(folder: Path, most: int) -> Beats:
    """The beats of all that share the folder, in a file that each of them maps."""
    with (folder / "beats").open("ab+") as file:
        file.truncate(2 * most * 8)
        shared: Any = (c_double * (2 * most)).from_buffer(mmap.mmap(file.fileno(), 0))
    return Beats(shared)


def new_folder(parent: Path) -> Path:
    """The name of a folder that is to be shared.

    Others are removed in which no process holds a number and none has beaten within `SPARED_S`.
    """
    for other in parent.glob("*"):
        if not (_has_beaten_lately(other) or any(map(is_held, other.glob("*.number")))):
            shutil.rmtree(other, ignore_errors=True)
    return parent / secrets.token_hex(8)


def _has_beaten_lately(folder: Path) -> bool:
    beats = folder / "beats"
    if not beats.is_file():
        return False
    now = time.monotonic()  # the same for all processes of a machine; later beats are of one that was restarted since
    return any(
        beaten and 0 <= now - beaten < SPARED_S for beaten in array("d", read_bytes(beats, MAX_BEATS_BYTES))[::2]
    )


def _locked(path: Path) -> int | None:
    """Descriptor of the file, which is locked as long as that is open; None where another process has it."""
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(file)
        return None
    return file


def is_held(path: Path) -> bool:
    """Whether a process holds the number of this file."""
    if (file := _locked(path)) is not None:
        os.close(file)
    return file is None
