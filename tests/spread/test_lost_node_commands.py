"""A command that loses a Ray node while it works ends as without Ray; `benchmarks/lost_nodes.py` tries all of them."""

import os
import subprocess
import sys
from pathlib import Path

from helpers.on_ray import MARKS

pytestmark = MARKS


def test_scenes_are_encoded_though_a_node_is_killed(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "helpers.lost_nodes", str(tmp_path), "scenes encode"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=400, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| True | 0 | the same |" in done.stdout
