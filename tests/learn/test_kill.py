"""`kill -9` at random moments, whatever is trained: nothing is lost, and all bits are those of a whole training."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from helpers.killed_trainings import NAMES

KILLS = {"ppo": 50, "a2c": 50}  # of others two


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork, which Windows has not")
@pytest.mark.parametrize("name", NAMES)
def test_a_killed_training_goes_on_to_the_same_bits(name: str, tmp_path: Path) -> None:
    kills = KILLS.get(name, 2)
    words = [sys.executable, "-m", "helpers.killed_trainings", str(tmp_path / name), name, str(kills), "0"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(name) and f" {kills} kills, all bits equal" in done.stdout
