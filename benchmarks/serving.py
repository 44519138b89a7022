"""`served`: a service in a process of its own, for the benchmarks of it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager


@contextmanager
def served(agent: str, *options: str, environment: Mapping[str, str] | None = None) -> Iterator[tuple[str, int]]:
    """A service in a process; gives its address, and the process's id.

    Args:
        agent: a file that clearway export wrote, a run folder, or generalist.
        options: of clearway serve.
        environment: beside this process's own.
    """
    words = [sys.executable, "-m", "clearway", "serve", agent, *options]
    variables = {**os.environ, "COLUMNS": "500", **(environment or {})}
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True, env=variables) as process:
        try:
            assert process.stderr is not None
            lines, found = [], None
            while found is None and (line := process.stderr.readline()):  # before, it may tell that it exports an agent
                lines.append(line)
                found = re.search(r"http://\S+", line)
            if found is None:
                sys.exit(f"the service did not start: {''.join(lines)}")
            yield found[0], process.pid
        finally:
            process.terminate()
