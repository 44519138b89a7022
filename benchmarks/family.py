"""A process with all that it has started: which they are, their memory, their time on a processor. Of Linux."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path


def family(pid: int) -> list[int]:
    """A process and all that it and those have started."""
    found = [pid]
    for each in found:
        for task in Path(f"/proc/{each}/task").glob("*/children"):
            with suppress(FileNotFoundError, ProcessLookupError):  # its thread has ended
                found += [int(child) for child in task.read_text().split()]
    return found


def resident_mib(pid: int) -> float:
    """Resident memory of a process; 0 where it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS:")), 0.0)


def processor_s() -> float:
    """Seconds on a processor of this process and of those that it has started and that run."""
    found = time.process_time()
    for pid in family(os.getpid())[1:]:
        for task in Path(f"/proc/{pid}/task").glob("*/schedstat"):
            with suppress(FileNotFoundError, ProcessLookupError):
                found += int(task.read_text().split()[0]) / 1e9
    return found
