"""Processes started with signals held never get them, the first one neither; and none outlives its parent."""

import select
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.skipif(sys.platform == "win32", reason="has no signal masks")
def test_the_first_child_gets_no_interrupt_either(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    said = subprocess.run([sys.executable, tmp_path / "program.py"], capture_output=True, text=True, check=True)
    assert said.stdout == "[2] 0\n"  # SIGINT is held in the child, nothing in the parent any more


PARENT = """
import multiprocessing, time
from clearway.children import end_with_parent

def child():
    end_with_parent()
    print("child", flush=True)
    while True:
        time.sleep(1)

if __name__ == "__main__":
    process = multiprocessing.get_context("spawn").Process(target=child)
    process.start()
    process.join()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no select on pipes")
def test_a_child_ends_when_its_parent_is_killed(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PARENT)
    with subprocess.Popen([sys.executable, tmp_path / "program.py"], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"child\n"
        assert select.select([parent.stdout], [], [], 0.5)[0] == []  # it lives while its parent does
        parent.kill()
        assert select.select([parent.stdout], [], [], 20)[0], "the child lives on"
        assert parent.stdout.read() == b""  # nobody has the pipe open any more
