"""Processes started with signals held never get them, the first one neither."""

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
