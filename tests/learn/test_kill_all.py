"""`kill -9` after the first checkpoint, whatever is trained: all bits are those of a whole training."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from helpers.killed_trainings import NAMES

KILLS = 2
ELSEWHERE = ("ppo", "a2c")  # fifty kills each: test_kill.py


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ELSEWHERE])
def test_a_killed_training_goes_on_to_the_same_bits(name: str, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "helpers.killed_trainings", str(tmp_path / name), name, str(KILLS), "0"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(name) and f" {KILLS} kills, all bits equal" in done.stdout
