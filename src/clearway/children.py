"""Child processes: none outlives its parent, each has limits of its own, and the terminal's signals may be held.

A child says so itself, first of all:

    end_with_parent(parent)  # the parent's process id, told by the parent
    limit(memory_bytes=1 << 30, seconds=60)
    open_nothing_more()  # once all is read that it needs
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import active_children, resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess

from clearway.errors import RunError

ORPHANED = 1  # exit code; nobody is left to see it
LOOKS_EVERY_S = 1.0
PR_SET_PDEATHSIG = 1  # of Linux's prctl
IMPORTED = 17  # exit code of a child that has imported the program
CHILD_S_MAIN = "__mp_main__"  # as a child imports the program; it may start none meanwhile, as Python sees to


def end_with_parent(parent: int) -> None:
    """End this process when its parent ends, however that ends and whatever this one is busy with.

    On Linux the system kills it, and takes the thread that started it for the parent: let a child be started by a
    thread that lives as long. Elsewhere a thread of this process looks for the parent every second. No effect on
    Windows, where a child has to notice that its pipe is closed.

    Args:
        parent: its process id; it may be gone already.

    Raises:
        OSError: the system refuses.
    """
    if sys.platform == "win32":
        return
    if sys.platform == "linux":
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0) != 0:
            raise OSError(ctypes.get_errno(), "prctl(PR_SET_PDEATHSIG) failed")
    else:
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    _end_if_orphaned(parent)


def _watch(parent: int) -> None:
    while True:
        time.sleep(LOOKS_EVERY_S)
        _end_if_orphaned(parent)


def _end_if_orphaned(parent: int) -> None:
    if os.getppid() != parent:  # it is somebody else's child by now
        os._exit(ORPHANED)


class ChildProcess(SpawnProcess):
    """A process of `multiprocessing` that ends with its parent as `end_with_parent` says, and never gets Ctrl+C.

    Ctrl+C is for its parent, which tells it by SIGTERM. It ends with its parent from the first moment on, though it may
    take seconds to import what it is to run; meanwhile its garbage collector rests, see `collector_rests`.
    """

    def start(self) -> None:
        """Start it."""
        with signals_held(signal.SIGINT):
            super().start()

    def run(self) -> None:
        """Run the target, once all is imported."""
        gc.enable()
        super().run()

    def __reduce__(self) -> tuple:
        """In the child the function is called before the state, and what that names, is read."""
        return _begun, (type(self), os.getpid()), self.__dict__


def _begun(kind: type[ChildProcess], parent: int) -> ChildProcess:
    end_with_parent(parent)
    gc.disable()
    return kind.__new__(kind)


@contextmanager
def collector_rests() -> Iterator[None]:
    """Collect no garbage meanwhile: imports leave none, and to look for it takes a sixth of the time of PyTorch's."""
    rested = not gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if not rested:
            gc.enable()


def children_import_program() -> bool:
    """A child of `multiprocessing` imports the program that was started, so that it knows the program's classes."""
    path = getattr(sys.modules["__main__"], "__file__", None)
    return path is not None and os.path.isfile(path)


def check_program() -> None:
    """Refuse a program that a child of `multiprocessing` cannot import, as all of them do when they begin.

    One child tries; what went wrong is printed there, as Python does.

    Raises:
        RunError: it cannot.
    """
    program = sys.modules["__main__"]
    path = getattr(program, "__file__", None)
    if path is None and CHILD_S_MAIN not in sys.modules:  # a notebook's, say, which no child looks for
        return
    remedy = 'Keep it in a file, what it runs below `if __name__ == "__main__":`'
    if path is not None and program.__spec__ is None and not os.path.isfile(path):
        raise RunError(f"{path}: no file, and worker processes import the program that starts them. {remedy}")
    child = ChildProcess(target=sys.exit, args=(IMPORTED,), daemon=True)
    try:
        child.start()
    except OSError:  # no room for a process: those who start more tell of it
        return
    try:
        child.join()
    finally:
        child.kill()  # where the user interrupted
    if child.exitcode != IMPORTED:
        problem = f"a worker process that imports this program, as all do, ended with {child.exitcode} (see above)"
        raise RunError(f"{path}: {problem}. {remedy}")


@contextmanager
def all_children_end() -> Iterator[None]:
    """Meanwhile, processes that other packages start by `multiprocessing`'s spawn are of `ChildProcess`.

    Those that still run at the end are killed: a package that was interrupted while it started them has lost them.
    """
    kind, before = SpawnContext.Process, set(active_children())
    SpawnContext.Process = ChildProcess
    try:
        yield
    finally:
        SpawnContext.Process = kind
        for child in set(active_children()) - before:
            if isinstance(child, ChildProcess):
                child.kill()
                child.join()


def command_of(module: str) -> list[str]:
    """Words that run a module's `main` in a child of this process, which `end_with_parent`; its arguments come after.

    The child looks for modules where this process does, also in another folder.
    """
    path = [os.path.abspath(folder) for folder in sys.path]
    statements = (
        f"import sys; sys.path[:] = {path!r}",
        f"from clearway.children import collector_rests, end_with_parent; end_with_parent({os.getpid()})",
        f"with collector_rests(): from {module} import main",
        "main()",
    )
    return [sys.executable, "-S", "-c", "\n".join(statements)]


def limit(*, memory_bytes: int | None = None, seconds: int | None = None) -> None:
    """Bound this process: allocations beyond the memory fail, and once the time is over the system ends it by SIGALRM.

    Args:
        memory_bytes: of address space, on Linux; None: no bound.
        seconds: from now, whatever it is busy with, not on Windows; None: no bound.
    """
    if memory_bytes is not None and sys.platform == "linux":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    if seconds is not None and sys.platform != "win32":
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(seconds)


def open_nothing_more() -> None:
    """From now on this process can open no file, pipe or socket; what is open stays so. No effect on Windows."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))


@contextmanager
def signals_held(*numbers: signal.Signals) -> Iterator[None]:
    """Signals wait here meanwhile, and processes started meanwhile never get them. No effect on Windows."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the first process would start it, and starting it lets the signals through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
