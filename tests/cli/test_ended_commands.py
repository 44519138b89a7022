"""Whatever ends a command, nothing that it has started is left soon after; every command that starts some."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from helpers.spreading import exported, folder_of, generated, model, rooms, textured, unencoded, views

LONGEST_S = 30.0  # after its end, on a busy machine
PATIENCE_S = 200.0  # for a command to start what it starts
MARK = "CLEARWAY_MARK"  # in the environment of a command, and hence of all that it starts

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")

SIGNALS = [signal.SIGTERM, signal.SIGKILL, signal.SIGHUP]


TWO = ["--workers", "2"]
BUILD = ["scenes", "build", "--room", "bathroom", *TWO]
GENERATE = ["scenes", "generate", "--count", "40", *TWO]
SMALL = ["--frames", "20000", "--learners", "paper"]
COMMANDS: dict[str, tuple[Callable[[Path], list[str]], int]] = {
    "scenes import mjcf, compiling": (lambda folder: ["scenes", "import", "mjcf", textured(folder)], 1),
    "scenes import mjcf, rendering": (lambda folder: ["scenes", "import", "mjcf", model(folder), *TWO], 2),
    "scenes build": (lambda folder: BUILD, 2),
    "scenes generate": (lambda folder: GENERATE, 2),
    "scenes views": (lambda folder: ["scenes", "views", generated(folder), "--poses", "5000", *TWO[:1], "1"], 1),
    "scenes encode": (
        lambda folder: ["scenes", "encode", *unencoded(folder), *TWO],
        2,
    ),
    "train with A3C": (lambda folder: ["train", *rooms(folder), "--preset", "paper-a3c", "--threads", "2"], 2),
    "train by workers": (lambda folder: ["train", *rooms(folder), "--threads", "1", *TWO], 2),
    "pretrain by workers": (
        lambda folder: ["pretrain", views(folder), "--pictures", "1e6", "--threads", "1", *TWO],
        2,
    ),
    "serve": (lambda folder: ["serve", exported(folder), "--port", "0"], 3),
    "serve by replicas": (lambda folder: ["serve", exported(folder), "--port", "0", "--replicas", "2"], 8),
    "reproduce": (
        lambda folder: ["reproduce", "fig5", "--budget", "smoke", "--scenes", folder_of(rooms(folder)), *SMALL],
        1,
    ),
}
"""What makes a command's words in a folder, and how many processes it has at its busiest besides itself, at least."""
CHEAP = {("scenes import mjcf, compiling", signal.SIGKILL), ("scenes build", signal.SIGTERM)}
BY_HAND = {("serve", signal.SIGTERM), ("serve", signal.SIGKILL), ("serve by replicas", signal.SIGHUP)}
"""For the sake of time (80 s): tried by hand alone, which docs/security.md says."""

CASES = [
    pytest.param(name, number, id=f"{name}, {number.name}", marks=() if (name, number) in CHEAP else pytest.mark.slow)
    for name in COMMANDS
    for number in SIGNALS
    if (name, number) not in BY_HAND
]


@pytest.mark.parametrize(("name", "number"), CASES)
def test_nothing_is_left_of_a_command_that_is_ended(name: str, number: signal.Signals, tmp_path: Path) -> None:
    words, count = COMMANDS[name]
    command = [sys.executable, "-m", "clearway", *words(tmp_path)]
    command += [] if "serve" in name else ["--out", str(tmp_path / "out")]
    mark = f"{tmp_path}-{number.name}"
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(sys.path),
        "CLEARWAY_CACHE": str(tmp_path / "cache"),
        MARK: mark,
    }
    silent = subprocess.DEVNULL
    with subprocess.Popen(command, env=environment, stdout=silent, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        begun = time.monotonic()
        while len(marked(mark)) < 1 + count:
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() - begun < PATIENCE_S, f"{command} has started {marked(mark)}"
            time.sleep(0.01)
        process.send_signal(number)
        process.wait(PATIENCE_S)  # a training that is asked to end saves first
        ended = time.monotonic()
        while left := marked(mark):
            assert time.monotonic() - ended < LONGEST_S, f"left: {left}"
            time.sleep(0.01)


def marked(mark: str) -> dict[int, str]:
    """The commands of living processes whose environment has the mark, by number."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if f"{MARK}={mark}".encode() in (folder / "environ").read_bytes().split(b"\0"):
                found[int(folder.name)] = (folder / "cmdline").read_text().replace("\0", " ")
        except (PermissionError, FileNotFoundError, ProcessLookupError):  # another user's, or gone meanwhile
            continue
    return found
