"""How options are told of in help, and read."""

import os
import re
import subprocess
import sys
from contextlib import suppress

import pytest

from clearway.cli.known import command_of, options, subcommands
from clearway.cli.main import Command, main
from clearway.cli.train import Train


def leaves(commands: object, words: tuple[str, ...] = ()):
    """The words of every command that holds no others."""
    for name, kind in subcommands(commands).items():
        yield from leaves(kind, (*words, name)) if subcommands(kind) else ((*words, name),)


LEAVES = tuple(leaves(Command))


@pytest.mark.parametrize("words", LEAVES, ids=" ".join)
def test_help_speaks_of_no_types(clearway, words):
    answer = clearway(*words, "--help")
    assert answer.code == 0
    assert not re.search(r"\{None\}|None|\bINT\b|\bFLOAT\b|\bSTR\b|\[\[|\(default: \)|\(default: False\)", answer.out)


@pytest.mark.parametrize("words", [("train",), ("runs", "list"), ("scenes", "build")])
def test_a_run_s_settings_are_offered_to_train_alone(clearway, words):
    text = clearway(*words, "--help").out
    assert "YAML file" in text and ("run.yaml" in text) == (words == ("train",))


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("train", "--frmes", 5), "Did you mean --frames? Help: clearway train --help"),
        (("scenes", "build", "bathroom"), "Did you mean --room bathroom? Help: clearway scenes build --help"),
        (("trian",), "Did you mean train?"),
        (
            ("train", "x.h5", "--seed", "q"),
            "a whole number, such as 600000 or 6e5. Help: clearway train --help",
        ),
    ],
)
def test_a_refusal_names_what_was_meant_and_the_command_s_own_help(clearway, words, part):
    line = clearway(*words).refusal(part)
    assert "full helptext" not in line and line.endswith(" --help")


@pytest.mark.parametrize("words", [(), ("runs", "list"), ("evaluate",), ("view",)])
def test_help_is_as_wide_as_the_terminal_and_its_headings_are_plain(clearway, monkeypatch, words):
    monkeypatch.setenv("COLUMNS", "70")
    text = clearway(*words, "--help").out
    assert max(map(len, text.splitlines())) <= 70
    for internal in ("parameters options", "room options", "perturbations options", "these fields", "(default: '')"):
        assert internal not in text


@pytest.mark.parametrize("words", [(), ("train",)])
def test_help_in_colours_keeps_its_frames(words):
    """On a terminal, where lines hold more letters than are seen."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "clearway", *words, "--help"]
    environment = os.environ | {"COLUMNS": "80", "TERM": "xterm-256color", "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment):
        os.close(theirs)
        printed = b""
        with suppress(OSError):  # its end
            while part := os.read(ours, 65536):
                printed += part
    os.close(ours)
    assert b"\x1b[" in printed
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in printed.decode().splitlines()]
    assert max(map(len, lines)) == 80
    framed = lines[next(number for number, line in enumerate(lines) if line.startswith("╭")) :]
    assert all(line.startswith(tuple("╭│╰")) and len(line) == 80 for line in framed) and len(framed) > 20


def test_what_is_no_help_is_printed_as_it_is(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    with pytest.raises(SystemExit):
        main(["--tyro-print-completion", "bash"])
    script = capsys.readouterr().out
    assert len(script) > 10_000
    assert subprocess.run(["bash", "-n"], input=script, text=True, capture_output=True).returncode == 0


def test_choices_stand_in_the_order_written(clearway):
    assert "{bathroom,bedroom,living_room,kitchen,all}" in clearway("scenes", "build", "--help").out


def test_defaults_that_say_something_are_told(clearway):
    text = " ".join(clearway("train", "--help").out.replace("│", "").split())
    assert "actions and the choice of targets. (default: 0)" in text
    assert "--targets WORD ..." in text and "--frames N" in text and "--alpha X" in text


def test_whole_numbers_as_people_write_them(clearway, monkeypatch):
    read = []
    monkeypatch.setattr(Train, "run", lambda command: read.append(command))
    for text in ("1e6", "1_000_000", "1000000"):
        assert clearway("train", "x.h5", "--out", "run", "--frames", text, "--seed", "2").code == 0
    assert [(command.frames, command.seed) for command in read] == [(1_000_000, 2)] * 3


def test_the_class_of_a_command_and_its_options():
    assert command_of(("train", "x.h5"), Command) == (Train, 1)
    assert command_of(("scenes",), Command) == (None, 1)
    assert command_of(("scenes", "import", "mjcf", "x"), Command)[1] == 3
    found = options(Train)
    assert {"files", "from", "frames", "alpha", "clearance-m", "feature-store"} <= set(found)
    assert found["from"][1].name == "source"
