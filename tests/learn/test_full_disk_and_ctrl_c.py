"""A full disk while a checkpoint is written, and Ctrl+C on the command line: nothing is lost, nothing is doubled."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clearway.learn import train
from clearway.learn.checkpoint import newest_checkpoint, read_progress, read_training
from clearway.learn.run_folder import RunFolder
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene
from helpers.small_runs import equal_bits, small_learner, small_request


def environment() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONWARNINGS": "error"}


def run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, env=environment(), timeout=300)


def without_seconds(folder: RunFolder) -> list[dict[str, float]]:
    return [{name: value for name, value in row.items() if name != "seconds"} for row in folder.metrics()]


FULL_DISK = """
import resource, sys
from pathlib import Path
from clearway.learn import running, train
from helpers.small_runs import small_learner, small_request
train.set_threads(1)
train.SECONDS_BETWEEN_CHECKPOINTS = 0.0
save = running.save
def with_a_limit(trainer, folder, seconds):
    if trainer.updates == 3:  # the network's file fits, the optimiser's does not
        resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))
    save(trainer, folder, seconds)
running.save = with_a_limit
train.train(small_request(learner=small_learner(width=32)), Path(sys.argv[1]))
"""


@pytest.mark.slow
def test_a_checkpoint_that_cannot_be_written_leaves_the_one_before(tmp_path: Path) -> None:
    done = run([sys.executable, "-c", FULL_DISK, str(tmp_path / "run")])
    assert done.returncode == 1
    assert "cannot write the checkpoint" in done.stderr.splitlines()[-1] and "File too large" in done.stderr
    stopped = RunFolder(tmp_path / "run")
    before = newest_checkpoint(stopped.checkpoints)
    assert read_progress(before).frames == 160
    assert {path.name for path in stopped.checkpoints.iterdir()} == {"frames-000000000080", before.name}

    request = small_request(learner=small_learner(width=32))
    train.train(request, stopped.path, resume=True)
    whole = train.train(request, tmp_path / "whole")
    assert equal_bits(*[read_training(newest_checkpoint(folder.checkpoints)) for folder in (whole, stopped)])
    assert without_seconds(whole) == without_seconds(stopped)


FRAMES = 16_000


def command_line(scene: Path, out: Path) -> list[str]:
    small = ["--frames", str(FRAMES), "--set", "envs=20", "rollout_steps=8", "width=16", "--threads", "1"]
    return [sys.executable, "-m", "clearway", "train", str(scene), "--out", str(out), "--resume", *small]


@pytest.mark.slow
def test_ctrl_c_on_the_command_line_leaves_a_run_that_resumes_and_exits_with_130(tmp_path: Path) -> None:
    scene, out = tmp_path / "corridor.h5", tmp_path / "run"
    write_scene(corridor_scene(5), scene)
    command = command_line(scene, out)
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment()) as process:
        wait_for(out / "metrics.jsonl", process)
        process.send_signal(signal.SIGSTOP)  # it holds the folder while another one asks for it
        second = run(command)
        process.send_signal(signal.SIGCONT)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    assert second.returncode == 2 and "another process trains here" in second.stderr
    assert process.returncode == 130
    assert errors.rstrip().endswith("interrupted") and "Traceback" not in errors
    assert 0 < read_progress(newest_checkpoint(RunFolder(out).checkpoints)).frames < FRAMES

    for folder in (out, tmp_path / "whole"):
        done = run(command_line(scene, folder))
        assert done.returncode == 0, done.stderr
    runs = [RunFolder(out), RunFolder(tmp_path / "whole")]
    assert equal_bits(*[read_training(newest_checkpoint(run.checkpoints)) for run in runs])
    assert without_seconds(runs[0]) == without_seconds(runs[1])


def wait_for(file: Path, process: subprocess.Popen) -> None:
    """Until the file has content; the process must not end before."""
    deadline = time.monotonic() + 120
    while not file.exists() or not file.stat().st_size:
        assert process.poll() is None, process.stderr and process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.02)
