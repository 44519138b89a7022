"""Children end with their parent, within their own limits, and hear nothing of the terminal while signals are held."""

import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

posix = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
linux = pytest.mark.skipif(sys.platform != "linux", reason="counts on prctl and on a limit of address space")

PROGRAM = """
import multiprocessing, signal
from clearway.children import signals_held

def blocked(sender):
    sender.send(sorted(signal.pthread_sigmask(signal.SIG_BLOCK, ())))

if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    with signals_held(signal.SIGINT):
        child = context.Process(target=blocked, args=(sender,))
        child.start()
    print([int(number) for number in receiver.recv()], len(signal.pthread_sigmask(signal.SIG_BLOCK, ())))
    child.join()
"""


@posix
def test_the_first_child_gets_no_interrupt_either(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    said = subprocess.run([sys.executable, tmp_path / "program.py"], capture_output=True, text=True, check=True)
    assert said.stdout == "[2] 0\n"  # SIGINT is held in the child, nothing in the parent any more


IMPORTED_AGAIN = """
from clearway.children import check_program
{guard}
    check_program()
    print("checked", __name__, flush=True)
"""
GUARD = 'if __name__ == "__main__":'


def checked(words: list[str], folder: Path, program: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *words], input=program, capture_output=True, text=True, cwd=folder)


@pytest.mark.parametrize(
    "words", [["program.py"], ["-m", "program"], ["program.zip"], ["-c", IMPORTED_AGAIN.format(guard="if True:")]]
)
def test_a_program_that_children_can_import_or_need_not_passes(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(IMPORTED_AGAIN.format(guard=GUARD))
    with zipfile.ZipFile(tmp_path / "program.zip", "w") as archive:
        archive.write(tmp_path / "program.py", "__main__.py")
    said = checked(words, tmp_path)
    assert (said.returncode, said.stdout, said.stderr) == (0, "checked __main__\n", "")


@pytest.mark.parametrize("words", [["program.py"], ["-m", "program"]])
def test_a_program_that_runs_all_when_it_is_imported_is_refused(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(IMPORTED_AGAIN.format(guard="if True:"))
    said = checked(words, tmp_path)
    assert said.returncode == 1 and not said.stdout
    assert "has finished its bootstrapping phase" in said.stderr  # Python's own words
    (told,) = [
        line for line in said.stderr.splitlines() if "RunError" in line and "program.py: a worker process" in line
    ]
    assert told.endswith(f"ended with 1 (see above). Keep it in a file, what it runs below `{GUARD}`")


def test_a_program_that_ends_when_it_is_imported_is_refused(tmp_path: Path) -> None:
    ends = IMPORTED_AGAIN.format(guard="if __name__ != '__main__':\n    raise SystemExit(0)\nelse:")
    (tmp_path / "program.py").write_text(ends)
    said = checked(["program.py"], tmp_path)
    assert said.returncode == 1 and "program.py: a worker process that imports this program" in said.stderr
    assert "ended with 0" in said.stderr


def test_a_program_from_standard_input_is_refused(tmp_path: Path) -> None:
    said = checked(["-"], tmp_path, IMPORTED_AGAIN.format(guard=GUARD))
    assert said.returncode == 1 and not said.stdout
    told = said.stderr.splitlines()[-1]
    assert told.startswith("clearway.errors.RunError: <stdin>: no file, and worker processes import the program")


PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, "-c", sys.argv[1].format(parent=os.getpid())]).wait()
"""
CHILD = """
import sys
from clearway import children
sys.platform = {platform!r}
children.LOOKS_EVERY_S = 0.1
children.end_with_parent({{parent}})
print("ready", flush=True)
import time
time.sleep(60)
"""


@posix
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL, signal.SIGHUP])
@pytest.mark.parametrize("platform", [pytest.param("linux", marks=linux), "darwin"])
def test_a_child_ends_with_its_parent_however_that_ends(platform: str, number: signal.Signals) -> None:
    words = [sys.executable, "-c", PARENT, CHILD.format(platform=platform)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None and parent.stdout.readline() == "ready\n"
        parent.send_signal(number)
        began = time.monotonic()
        assert parent.stdout.read() == ""  # until nobody has it open any more
        assert time.monotonic() - began < 5


@posix
def test_a_child_whose_parent_is_gone_already_ends_at_once() -> None:
    program = "from clearway.children import end_with_parent\nend_with_parent(1)\nprint('still here')"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "")


@posix
def test_a_child_that_computes_for_too_long_is_ended_by_the_system() -> None:
    """In one long call of C, where no thread of Python would get to see the time."""
    program = "from clearway.children import limit\nlimit(seconds=1)\nprint(sum(range(10**13)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=30)
    assert done.returncode == -signal.SIGALRM


@linux
def test_a_child_gets_no_more_memory_than_its_limit() -> None:
    program = "from clearway.children import limit\nlimit(memory_bytes=1 << 28)\nbytearray(1 << 28)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr.endswith("MemoryError\n")


CLOSED = """
import socket, sys
from clearway.children import open_nothing_more

open_nothing_more()
for opened in (lambda: open("/etc/hostname"), lambda: open("left", "w"), socket.socket):
    try:
        opened()
    except OSError as fault:
        print(fault.strerror)
"""


@posix
def test_a_child_that_is_shut_off_opens_nothing_and_still_speaks() -> None:
    said = subprocess.run([sys.executable, "-c", CLOSED], capture_output=True, text=True, check=True)
    assert said.stdout == "Too many open files\n" * 3
