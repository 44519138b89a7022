"""Numbers of replicas that nobody has started together."""

from __future__ import annotations

import contextlib
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from clearway.errors import DeployError
from clearway.serve.own_number import beats_in, new_folder, own_number
from helpers.holders import holders
from helpers.running import PATIENT_S
from helpers.serving import ENVIRONMENT

HOLDS = """
import sys
from pathlib import Path
from clearway.serve.own_number import beats_in, own_number
folder = Path(sys.argv[1])
beats_in(folder, 2).beat(own_number(folder, 2), True)
print(flush=True)
sys.stdin.read()
"""
HELD = """
import sys
from pathlib import Path
from clearway.serve.own_number import own_number
own_number(Path(sys.argv[1]), 2)
"""


def test_a_number_is_held_until_its_process_ends_and_an_empty_folder_goes(tmp_path: Path) -> None:
    folder = new_folder(tmp_path)
    folder.mkdir()
    words, pipe = [sys.executable, "-c", HOLDS, str(folder)], subprocess.PIPE
    with subprocess.Popen(words, env=ENVIRONMENT, stdin=pipe, stdout=pipe) as other:
        assert other.stdout is not None and other.stdout.readline()
        assert holders(folder) == [other.pid]
        assert beats_in(folder, 2).any_ready()
        assert new_folder(tmp_path) != folder and folder.exists()
        assert own_number(folder, 2) == 1
        with pytest.raises(DeployError, match="2 replicas run there already"):
            own_number(folder, 2)
        other.kill()
        other.wait(PATIENT_S)
    assert holders(folder) == [os.getpid()]
    assert own_number(folder, 2) == 0
    dead = tmp_path / "dead"
    dead.mkdir()
    (dead / "0.number").write_text(str(other.pid))
    new_folder(tmp_path)
    assert folder.exists() and not dead.exists()


def test_the_folder_of_replicas_that_are_just_restarted_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = new_folder(tmp_path)
    subprocess.run([sys.executable, "-c", HELD, str(folder)], env=ENVIRONMENT, check=True)
    assert not holders(folder)
    new_folder(tmp_path)
    assert folder.exists()
    monkeypatch.setattr("clearway.serve.own_number.SPARED_S", 0.0)
    new_folder(tmp_path)
    assert not folder.exists()


def test_who_has_locked_a_number_and_not_written_yet_is_not_told(tmp_path: Path) -> None:
    with subprocess.Popen(["true"]) as dead:
        dead.wait(PATIENT_S)
    for name, text in (("0", ""), ("1", str(dead.pid)), ("2", str(os.getpid()))):
        with open(tmp_path / f"{name}.number", "w") as file:
            file.write(text)
    with contextlib.ExitStack() as held:
        for path in tmp_path.glob("*.number"):
            fcntl.flock(held.enter_context(path.open()), fcntl.LOCK_EX)
        assert holders(tmp_path) == [os.getpid()]
    assert not holders(tmp_path)


def test_beats_that_nobody_gave_spare_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slot that was never used holds 0, which is lately on a machine that has just been started."""
    folder = new_folder(tmp_path)
    folder.mkdir()
    (folder / "beats").write_bytes(bytes(64))
    monkeypatch.setattr("clearway.serve.own_number.time.monotonic", lambda: 100.0)
    new_folder(tmp_path)
    assert not folder.exists()
