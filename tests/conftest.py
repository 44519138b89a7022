import gc
import os
import signal
import sys
from collections.abc import Iterator

import pytest

from helpers.servers_of_files import object_store, s3  # fixtures of all tests

__all__ = ["object_store", "s3"]

# Containers like to forbid it, and then each of the hundreds of interpreters that tests start would compile every
# module that it imports, and each of pytest's processes all assertions.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


gc.disable()  # while all is imported


def pytest_collection_finish() -> None:
    """What is there by now stays: the garbage collector need not look at it again and again, nor every moment."""
    gc.enable()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture(autouse=True, scope="session")
def _no_waiting_for_the_disk() -> Iterator[None]:
    """No test cuts the power: what is written need not reach the disk."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda file: None)
        yield


@pytest.fixture(autouse=True, scope="session")
def _one_thread() -> Iterator[None]:
    """Tiny tensors: more threads cost time, and bits repeat at one thread count."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(autouse=True, scope="session")
def _interruptible() -> None:
    """A shell lets what it starts with & ignore Ctrl+C, nohup its end, and so would all that a test interrupts."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
