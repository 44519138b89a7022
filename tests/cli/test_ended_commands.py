"""Whatever ends a command, nothing that it has started is left five seconds later; every command that starts some."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from clearway.scenes.thor_v1 import write_scene
from helpers.made import grid_scene
from helpers.small_setting import small_rooms

LONGEST_S = 5.0  # after its end
PATIENCE_S = 90.0  # for a command to start what it starts
MARK = "CLEARWAY_MARK"  # in the environment of a command, and hence of all that it starts

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")

SIGNALS = [signal.SIGTERM, signal.SIGKILL, signal.SIGHUP]


def rooms(folder: Path) -> list[str]:
    """Two scene files."""
    for scene in small_rooms():
        write_scene(scene, folder / f"{scene.name}.h5")
    return [str(path) for path in sorted(folder.glob("*.h5"))]


def folder_of(files: list[str]) -> str:
    return str(Path(files[0]).parent)


def model(folder: Path) -> str:
    """A MuJoCo model that takes a while."""
    boxes = "".join(f'<geom type="box" size=".1 .1 .1" pos="{i * 0.3} 3 .1"/>' for i in range(20))
    path = folder / "hall.xml"
    path.write_text(
        f'<mujoco><worldbody><geom type="plane" size="4 4 .1"/>{boxes}<light pos="0 0 4"/></worldbody></mujoco>'
    )
    return str(path)


def generated(folder: Path) -> str:
    """A generated room, which views can be taken of."""
    command = [sys.executable, "-m", "clearway", "scenes", "generate", "--encoder", "none"]
    subprocess.run([*command, "--workers", "1", "--out", str(folder / "rooms")], check=True, capture_output=True)
    return str(folder / "rooms")


def textured(folder: Path) -> str:
    """A model whose texture takes a second to make and compile."""
    path = folder / "bomb.xml"
    texture = '<texture name="t" type="2d" builtin="checker" width="10000" height="10000"/>'
    path.write_text(f"<mujoco><asset>{texture}</asset></mujoco>")
    return str(path)


def unencoded(folder: Path) -> list[str]:
    """Two scenes with many pictures."""
    for number in range(2):
        write_scene(grid_scene(number, width=8, depth=8, picture_size=(96, 128)), folder / f"{number}.h5")
    return [str(path) for path in sorted(folder.glob("*.h5"))]


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
    "reproduce": (
        lambda folder: ["reproduce", "fig5", "--budget", "smoke", "--scenes", folder_of(rooms(folder)), *SMALL],
        1,
    ),
}
"""What makes a command's words in a folder, and how many processes it has at its busiest besides itself, at least."""
CHEAP = {("scenes import mjcf, compiling", signal.SIGKILL), ("scenes build", signal.SIGTERM)}


CASES = [
    pytest.param(name, number, id=f"{name}, {number.name}", marks=() if (name, number) in CHEAP else pytest.mark.slow)
    for name in COMMANDS
    for number in SIGNALS
]


@pytest.mark.parametrize(("name", "number"), CASES)
def test_nothing_is_left_of_a_command_that_is_ended(name: str, number: signal.Signals, tmp_path: Path) -> None:
    words, count = COMMANDS[name]
    command = [sys.executable, "-m", "clearway", *words(tmp_path), "--out", str(tmp_path / "out")]
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
