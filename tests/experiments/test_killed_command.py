"""`clearway reproduce` killed at random moments and started again: the figures of an undisturbed one. Slow."""

import json
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from helpers.small_setting import small_setting

KILLS = 6

pytestmark = pytest.mark.slow


def command(scenes: Path, out: Path) -> list[str]:
    words = ["--scenes", str(scenes), "--out", str(out), "--frames", "20000", "--learners", "paper"]
    return [sys.executable, "-m", "clearway", "reproduce", "fig3", "fig5", "--budget", "smoke", *words]


def sections(out: Path) -> object:
    return json.loads((out / "report.json").read_text())["sections"]


def written(out: Path) -> dict[Path, int]:
    """Files of the runs and their sizes."""
    while True:
        with suppress(FileNotFoundError):  # a part was put in place, or an old checkpoint removed, meanwhile
            return {path: path.stat().st_size for path in out.glob("runs/*/**/*.json*")}


def test_kills_at_random_moments_leave_the_same_figures_as_none(tmp_path: Path) -> None:
    small_setting(tmp_path)
    scenes, whole, killed = tmp_path / "scenes", tmp_path / "whole", tmp_path / "killed"
    began = time.monotonic()
    subprocess.run(command(scenes, whole), check=True, capture_output=True, timeout=300)
    longest_s = (time.monotonic() - began) / KILLS  # from the first line that a command adds to its death
    moments = random.Random(0)
    trials = []
    for _ in range(KILLS):
        with subprocess.Popen(command(scenes, killed), stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            before = written(killed)
            while written(killed) == before and process.poll() is None:
                time.sleep(0.05)
            time.sleep(moments.uniform(0, longest_s))
            process.kill()
            assert process.wait() in (0, -signal.SIGKILL), process.stderr.read()
        trials.append(len(list(killed.glob("runs/*/trials/*.json"))))
    done = subprocess.run(command(scenes, killed), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert trials[0] < len(list(whole.glob("runs/*/trials/*.json"))), "the first kill came too late"
    assert sections(killed) == sections(whole)
