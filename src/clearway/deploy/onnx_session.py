"""`BoundedSession`: onnxruntime in a process of its own, which is killed when a file's graph takes too long.

Few bytes of a graph can ask for any amount of memory and time: a number repeated to a hundred gigabytes, one product of
two large matrices. onnxruntime looks at a limit of time between operators only, so the process that asks runs none.
"""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import threading
import weakref
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from importlib.metadata import packages_distributions, version
from importlib.util import find_spec
from typing import Any, cast

import numpy as np

from clearway.children import command_of
from clearway.deploy.onnx_worker import read_message, write_message
from clearway.errors import DeployError, install_hint

MEMORY_LIMIT_BYTES = 4 << 30  # of a file's weights and of all that its graph computes
ADDRESS_LIMIT_BYTES = 2 * MEMORY_LIMIT_BYTES  # of its process, with the libraries and the file
ADDRESS_BYTES_A_CORE = 160 << 20  # further, which a thread may reserve
TIME_LIMIT_S = 60.0  # of a call
OPENING_LIMIT_S = 60.0
MESSAGE_LIMIT_BYTES = 2 << 30  # of all inputs or outputs of a call, and of a file


class BoundedSession:
    """A graph that is run within limits. Threads may share it; calls are answered one after the other.

    Args:
        content: the ONNX file.
        source: its path, for errors.
        threads: processor threads; None: one a core.

    Attributes:
        metadata: of the file.

    Raises:
        DeployError: onnxruntime is not installed, or cannot run it.
    """

    def __init__(self, content: bytes, source: str, threads: int | None) -> None:
        if find_spec("onnxruntime") is None:
            raise DeployError(f"{source}: needs onnxruntime. {install_hint('onnx')}")
        self._content, self._source, self._threads = content, source, threads
        self._lock = threading.Lock()
        _SESSIONS.add(self)
        self._process, self.metadata = self._started()

    def run(self, outputs: Sequence[str], given: Mapping[str, np.ndarray]) -> list[np.ndarray]:
        """The outputs of these names, by the inputs.

        Raises:
            DeployError: it takes more than the limits of memory and time, the graph is not what its card says, or the
                system has no thread or process left for it.
        """
        with self._lock:
            if not self._process.is_ours:
                self._process, _ = self._started()
            asked = {"outputs": list(outputs), "inputs": list(given)}
            with self._places_needed():
                told, arrays = self._process.answer(asked, list(given.values()), TIME_LIMIT_S)
        if (reason := told.get("fault")) is not None:
            limits = f"{TIME_LIMIT_S:g} s and {MEMORY_LIMIT_BYTES >> 30} GiB"
            problem = f"{self._source}: its graph cannot be run ({reason}; its limits: {limits})"
            raise DeployError(f"{problem}. Export it again, or give fewer pictures at once")
        return arrays

    def _started(self) -> tuple[_Process, Mapping[str, str]]:
        """A process that has opened the file, and the file's metadata."""
        with self._places_needed():
            process = _Process(self._threads)
            told, _ = process.answer({}, [np.frombuffer(self._content, np.uint8)], OPENING_LIMIT_S)
        reason = told.get("fault")
        if reason is None and not isinstance(told.get("metadata"), dict):
            reason = "its process told no metadata"
        if reason is not None:
            process.end()
            raise DeployError(f"{self._source}: {_installed()} cannot run it ({reason}). Upgrade it")
        return process, told["metadata"]

    @contextmanager
    def _places_needed(self) -> Iterator[None]:
        """Raises DeployError where the system has no place for a process or a thread."""
        try:
            yield
        except OSError as fault:
            problem = f"{self._source}: no process can be started for it ({fault.strerror})"
            raise DeployError(f"{problem}. End others, or raise the limit of processes") from fault


_SESSIONS: weakref.WeakSet[BoundedSession] = weakref.WeakSet()


def _renew_locks() -> None:
    """In a copy of a process nobody would release a lock that another thread held."""
    for session in _SESSIONS:
        session._lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_locks)


def _installed() -> str:
    """Whatever onnxruntime is installed by, with its version: it comes under several names, one a kind of processor."""
    names = sorted(set(packages_distributions().get("onnxruntime", ())))
    return ", ".join(f"{name} {version(name)}" for name in names) or "onnxruntime"


class _Process:
    """A process of `onnx_worker`, which ends with this one, or once this object is forgotten."""

    def __init__(self, threads: int | None) -> None:
        """Start it. Raises OSError."""
        job = {
            "address_bytes": ADDRESS_LIMIT_BYTES + (os.cpu_count() or 1) * ADDRESS_BYTES_A_CORE,
            "memory_bytes": MEMORY_LIMIT_BYTES,
            "message_bytes": MESSAGE_LIMIT_BYTES,
            "threads": threads,
        }
        started: Future[subprocess.Popen[bytes]] = Future()
        words = [*command_of("clearway.deploy.onnx_worker"), json.dumps(job)]
        self._keeper = threading.Thread(target=_keep, args=(words, started), daemon=True)
        _begin(self._keeper)
        self._process = started.result()
        self.end = weakref.finalize(self, _end, self._process, os.getpid())
        self._owner = os.getpid()

    @property
    def is_ours(self) -> bool:
        """It runs, and no other process, of which this one is a copy, has started it."""
        return self.end.alive and self._keeper.is_alive() and self._owner == os.getpid()

    def answer(
        self, asked: dict[str, Any], arrays: Sequence[np.ndarray], limit_s: float
    ) -> tuple[dict[str, Any], list[np.ndarray]]:
        """What it answers; {"fault": why} where it ended, or was killed because it took longer than the limit.

        Raises OSError where there is no thread for the limit.
        """
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        overran = threading.Event()

        def kill() -> None:
            overran.set()
            process.kill()

        late = threading.Timer(limit_s, kill)
        late.daemon = True
        _begin(late)
        try:
            write_message(cast(Any, process.stdin), asked, arrays)
            return read_message(cast(Any, process.stdout), MESSAGE_LIMIT_BYTES)
        except (OSError, EOFError):
            self._keeper.join(limit_s)
            if overran.is_set():
                return {"fault": f"not over after {limit_s:g} s"}, []
            return {"fault": _how_it_ended(process.returncode)}, []
        except ValueError as fault:
            self.end()
            return {"fault": str(fault)}, []
        except BaseException:  # Ctrl+C: its answer would be taken for that of the next call
            self.end()
            raise
        finally:
            late.cancel()


def _begin(thread: threading.Thread) -> None:
    """Start a thread. Raises OSError where the system has no more of them."""
    try:
        thread.start()
    except RuntimeError as fault:
        raise OSError(errno.EAGAIN, str(fault)) from fault


def _keep(words: Sequence[str], started: Future[subprocess.Popen[bytes]]) -> None:
    """Start a process, and live as long as it does: the system ends it with the thread that has started it."""
    ends: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    ends["bufsize"] = 0  # a buffer has a lock, which in a copy of this process would be held for ever
    try:
        process = subprocess.Popen(words, start_new_session=True, **ends)
    except OSError as fault:
        started.set_exception(fault)
        return
    started.set_result(process)
    process.wait()


def _end(process: subprocess.Popen[bytes], owner: int) -> None:
    """Kill a process, where this one has started it, and close the pipes to it."""
    if owner == os.getpid():
        process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):  # what was not yet sent is lost with it
                pipe.close()


def _how_it_ended(code: int | None) -> str:
    how = f"signal {signal.Signals(-code).name}" if code is not None and code < 0 else f"exit code {code}"
    return f"its process ended with {how}"
