"""What holds for every command: help, start-up, exit codes, warnings."""

import errno
import os
import re
import resource
import shlex
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest
import torch

import clearway as package
from clearway.cli.console import showing_warnings
from clearway.cli.imports.command import ImportScenes
from clearway.cli.main import Command, Scenes
from clearway.cli.runs import Runs
from clearway.cli.scenes import Inspect
from clearway.errors import ClearwayError
from clearway.scenes.validate import SceneWarning

COMMANDS = {
    "demo",
    "examples",
    "scenes build",
    "scenes generate",
    "scenes views",
    "scenes import thor-v1",
    "scenes import floor-plan",
    "scenes import images",
    "scenes import savn",
    "scenes import avd",
    "scenes import ai2thor",
    "scenes import mjcf",
    "scenes import miniworld",
    "scenes import plugin",
    "scenes encode",
    "scenes inspect",
    "scenes export",
    "scenes view",
    "pretrain",
    "train",
    "runs list",
    "runs compare",
    "runs clean",
    "evaluate",
    "oracle",
    "reproduce",
    "report",
    "video",
    "export",
    "serve",
    "plugins",
    "view",
}


GROUPS = {Scenes: "command", Runs: "command", ImportScenes: "kind"}  # commands that hold others, and where


def kinds(commands: object) -> Iterator[type]:
    """The classes behind all commands, those of a group in its place."""
    for annotated in get_args(commands):
        kind = get_args(annotated)[0]
        part = GROUPS.get(kind)
        yield from kinds(get_type_hints(kind, include_extras=True)[part]) if part else (kind,)


KINDS = tuple(kinds(Command))
HEAVY = ("torch", "mujoco", "transformers", "matplotlib", "scipy", "h5py", "numpy")
MOST_TIMES = 3  # what reading tyro alone takes, some 0.16 seconds: help answers within 0.5
TRIES = 6  # others may be using the machine; one is enough on an idle one
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(package.__file__).parents[1])}


def python(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words], env=ENVIRONMENT, capture_output=True, text=True, check=True, timeout=60
    )


def processor_seconds(*words: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    python(*words)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def test_help_answers_at_once():
    """Against a reference in the same breath: how fast a shared machine is changes from hour to hour."""
    assert any(
        processor_seconds("-m", "clearway", "--help") < MOST_TIMES * processor_seconds("-c", "import tyro")
        for _ in range(TRIES)
    )


def test_nothing_heavy_is_imported_before_a_command_runs():
    code = f"import sys, clearway.cli.main; print([name for name in {HEAVY} if name in sys.modules])"
    assert python("-c", code).stdout.strip() == "[]"


def test_python_runs_the_package():
    assert python("-m", "clearway", "--version").stdout == f"clearway {package.__version__}\n"


def helps(clearway, words: tuple[str, ...] = ()) -> Iterator[tuple[str, str]]:
    """Every command by its words, with its help."""
    answer = clearway(*words, "--help")
    assert (answer.code, answer.err) == (0, "")
    inner = re.match(r"usage: clearway[a-z ]* \[-h\] \{([\w,-]+)\}\n", answer.out)
    if words:
        yield " ".join(words), answer.out
    for name in inner[1].split(",") if inner else ():
        yield from helps(clearway, (*words, name))


def test_every_command_has_help_with_an_example_that_can_be_read(clearway, monkeypatch):
    run = []
    for kind in KINDS:
        monkeypatch.setattr(kind, "run", lambda command: run.append(command))
    found = dict(helps(clearway))
    assert found.keys() >= COMMANDS | {"scenes"}
    for words, text in found.items():
        (example,) = re.findall(r"^Example: clearway (.+)$", text.split("╭")[0], re.MULTILINE)
        assert example.startswith(words)
        assert not re.search(r"(?<![=\d])\d{1,3},\d{3}\b", text), "a narrow terminal breaks the line after a comma"
        assert clearway(*shlex.split(example)).code == 0, example
    assert {type(command) for command in run} == set(KINDS)
    assert len(KINDS) == len(COMMANDS)


def raising(error: BaseException):
    def run(self: object) -> None:
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (ClearwayError("x.h5: broken\n in two ways. Mend it"), 2, "error: x.h5: broken\\n in two ways. Mend it\n"),
        (
            PermissionError(13, "Permission denied", "out/x.h5"),
            2,
            "error: out/x.h5: Permission denied. Check the path, its permissions and the space left\n",
        ),
        (
            OSError(28, "No space left on device"),
            2,
            "error: No space left on device. Check the path, its permissions and the space left\n",
        ),
    ],
    ids=["interrupted", "refused", "forbidden", "full"],
)
def test_exit_codes(clearway, monkeypatch, error, code, said):
    monkeypatch.setattr(Inspect, "run", raising(error))
    answer = clearway("scenes", "inspect", "x.h5")
    assert (answer.code, answer.out, answer.err) == (code, "", said)


@pytest.mark.parametrize(
    "allocate",
    [lambda: bytearray(1 << 60), lambda: np.zeros(1 << 58), lambda: torch.zeros(1 << 58)],
    ids=["Python", "NumPy", "PyTorch"],
)
def test_memory_that_runs_out_is_one_line(clearway, monkeypatch, allocate):
    monkeypatch.setattr(Inspect, "run", lambda self: allocate())
    line = clearway("scenes", "inspect", "x.h5").refusal("not enough memory (", "--resume")
    assert "Free some" in line


def test_our_own_mistakes_are_not_hidden(clearway, monkeypatch):
    for mistake in (ZeroDivisionError, RuntimeError):
        monkeypatch.setattr(Inspect, "run", raising(mistake()))
        with pytest.raises(mistake):
            clearway("scenes", "inspect", "x.h5")


def test_warnings_are_a_line_on_standard_error(clearway, dump, tmp_path):
    def lie(file) -> None:
        file["shortest_path_distance"][0, 5] = 77

    path = dump(tmp_path / "attic.h5", change=lie)
    answer = clearway("scenes", "inspect", path, "--json")
    assert answer.code == 0
    assert answer.json["states"] == 76  # standard output holds the JSON alone
    (line,) = answer.err.splitlines()
    assert line.startswith(f"warning: {path}: ")
    assert "shortest_path_distance is wrong for 1 pairs" in line
    assert "Warning" not in answer.err and ".py" not in answer.err


def test_warnings_are_shown_once_whatever_python_was_told(capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with showing_warnings():
            for _ in range(3):
                warnings.warn("another encoder\nstands in", SceneWarning, stacklevel=1)
            warnings.warn("another encoder\nstands in", SceneWarning, stacklevel=1)  # at another place
            warnings.warn("of no use to a user", DeprecationWarning, stacklevel=1)
        with pytest.raises(SceneWarning):  # outside, all is as before
            warnings.warn("another encoder stands in", SceneWarning, stacklevel=1)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == "warning: another encoder stands in\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("into", "code", "told"), [("> /dev/full", 2, "No space left on device"), ("| true", 0, ""), ("| head -n 1", 0, "")]
)
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
def test_what_cannot_be_printed_is_told_in_one_line_or_let_be(trained, into, code, told):
    program, scene = shlex.quote(sys.executable), shlex.quote(str(trained.scene))
    command = f"{program} -m clearway scenes inspect {scene} --json {into}"
    line = f"set -o pipefail; {command}; exit ${{PIPESTATUS[0]:-$?}}"
    done = subprocess.run(["bash", "-c", line], env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
    assert done.returncode == code, done.stderr
    assert told in done.stderr and len(done.stderr.splitlines()) == bool(told)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
def test_a_version_that_cannot_be_printed_is_told_in_one_line():
    command = f"{shlex.quote(sys.executable)} -m clearway --version > /dev/full"
    done = subprocess.run(["bash", "-c", command], env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr


@pytest.mark.slow
def test_a_terminal_without_the_letters_gets_others(trained):
    command = [sys.executable, "-m", "clearway", "evaluate", str(trained.run), "--episodes", "1", "--step-limit", "1"]
    done = subprocess.run(
        command, env={**ENVIRONMENT, "PYTHONIOENCODING": "ascii"}, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert "collision-aware" in done.stdout and done.stdout.isascii()


def test_a_pipe_broken_elsewhere_is_no_success(clearway, trained, monkeypatch):
    def broken(*_, **__):
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    monkeypatch.setattr(Inspect, "run", broken)
    assert clearway("scenes", "inspect", trained.scene).refusal("Broken pipe")
