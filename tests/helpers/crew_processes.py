"""The workers of a training that another process has started."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

PATIENCE_S = 200.0  # of a machine with much else to do, where each process takes seconds to begin


def workers_of(parent: int) -> list[int]:
    """Process ids of a training's workers."""
    try:
        children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
        return [int(pid) for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    except FileNotFoundError:
        return []


def wait_until(condition: object, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():  # type: ignore[operator]
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.01)
