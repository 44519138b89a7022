"""Kill -9 at random moments after the first checkpoint, for every algorithm: are all bits those of a whole training?

python benchmarks/kills.py --kills 13            # of each of eight
python benchmarks/kills.py --only recurrent --kills 50 --seed 1
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
NAMES = ("ppo", "a2c", "a3c", "bc", "q-learning", "recurrent", "adapt", "pretrain")


def main() -> None:
    """Try them one after the other, each in a process of its own; ends with 1 where one went wrong."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=13)
    options.add_argument("--only", nargs="*", choices=NAMES, default=NAMES)
    options.add_argument("--seed", type=int, default=0)
    asked = options.parse_args()
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(TESTS), *filter(None, sys.path)])}
    wrong = 0
    for name in asked.only:
        with tempfile.TemporaryDirectory() as folder:
            words = ["-m", "helpers.killed_trainings", f"{folder}/{name}", name, str(asked.kills), str(asked.seed)]
            wrong += subprocess.run([sys.executable, *words], env=environment, check=False).returncode != 0
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
