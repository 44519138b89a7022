"""What a service needs of the system before it starts."""

import subprocess
import sys

import pytest

from helpers.serving import ENVIRONMENT

resource = pytest.importorskip("resource", reason="only Unix bounds a process's open files")

PROGRAM = """
import resource, sys
from clearway.serve.run import allowed_connections
soft, hard, wanted = map(int, sys.argv[1:])
resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
print(allowed_connections(wanted), *resource.getrlimit(resource.RLIMIT_NOFILE))
"""


@pytest.mark.parametrize(
    ("before", "wanted", "allowed", "after"),
    [
        ((256, 900), 500, 500, (700, 900)),
        ((800, 900), 500, 500, (800, 900)),
        ((256, 300), 500, 100, (300, 300)),
        ((150, 150), 500, 1, (150, 150)),
    ],
    ids=["raised", "enough", "clamped", "hardly any"],
)
def test_as_many_files_may_be_open_as_connections_need(before, wanted, allowed, after) -> None:
    words = [sys.executable, "-c", PROGRAM, *map(str, (*before, wanted))]
    done = subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(value) for value in (allowed, *after)]
    told = f"at most {allowed} connections at a time, not {wanted}: this process may open {after[1]} files"
    assert (told in done.stderr) == (allowed < wanted)
