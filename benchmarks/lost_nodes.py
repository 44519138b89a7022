"""SIGKILL for a node of a Ray cluster beneath every command that takes `--ray`: does it come to the same?

python benchmarks/lost_nodes.py                      # all nine commands, some ten minutes; needs the extra ray
python benchmarks/lost_nodes.py "scenes encode" train
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"


def main() -> None:
    """Print a table; ends with 1 where a command came to something else."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(TESTS), *filter(None, sys.path)])}
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "helpers.lost_nodes", folder, *sys.argv[1:]]
        sys.exit(subprocess.run(words, env=environment, check=False).returncode)


if __name__ == "__main__":
    main()
