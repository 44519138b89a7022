"""Parts done in processes of this machine; one that dies takes no other with it.

Each process is driven by a thread of a pool, which starts it when there is a part to do. The processes are plain
subprocesses rather than `multiprocessing`'s: their environment can differ from ours, a script needs no
`if __name__ == "__main__":`, and how one died is known.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property
from typing import IO, Any

from clearway.spread.messages import from_message, to_message
from clearway.spread.worker import packed, read_message, write_message
from clearway.spread.workers import Part, Result, Tool, Work

GRACE_S = 60.0  # for processes to end when they are told to: training saves a checkpoint first
COMMAND = (
    "import sys; sys.path[:] = {path!r}; from clearway.children import end_with_parent; end_with_parent({parent}); "
    "from clearway.spread.worker import main; main()"
)


class _Died(Exception):
    """A process ended before it answered; says how."""

    def __init__(self, how: str, killed: bool) -> None:
        super().__init__(how)
        self.killed = killed


@contextmanager
def processes(work: Work[Tool, Part, Result], count: int) -> Iterator[Callable[[Part], Future[Result]]]:
    """What lets a part be done in one of `count` processes, which end when the block does: see `workers_for`."""
    crew = _Crew(work)
    threads = ThreadPoolExecutor(count, initializer=_hear_no_interrupts)
    try:
        yield lambda part: threads.submit(crew.done, part)
    finally:
        try:
            crew.end()
        finally:
            crew.kill()
            threads.shutdown(cancel_futures=True)
            crew.close()


def _hear_no_interrupts() -> None:
    """Leave Ctrl+C to the main thread; processes that this thread starts do not hear it either."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


class _Crew:
    """The processes of a work, one for each thread that asks."""

    def __init__(self, work: Work) -> None:
        self.work = work
        self.started: list[_Process] = []
        self.files = ExitStack()
        self.own = threading.local()
        self.lock = threading.Lock()
        self.ending = False

    def done(self, part: Any) -> Any:
        """The result of a part, by this thread's process.

        Raises:
            ClearwayError: what `work.died` makes of a process that died, or what the part raised.
        """
        message = to_message(part)
        attempt = 0
        while True:
            attempt += 1
            try:
                if getattr(self.own, "process", None) is None:
                    self.own.process = self._start()
                try:
                    return self.own.process.done(message)
                finally:
                    if self.ending:  # where it finished its part instead, nobody would tell it again
                        self.own.process.kill()
            except _Died as death:
                self.own.process = None
                if not death.killed or attempt >= self.work.attempts or self.ending:
                    times = f", attempt {attempt}" if self.work.attempts > 1 else ""
                    raise self.work.died(part, f"{death}{times}") from death

    def _start(self) -> _Process:
        with self.lock:
            if self.ending:
                raise CancelledError
            messages = None
            if self.work.keeps_messages:
                messages = self.files.enter_context(tempfile.TemporaryFile())  # noqa: SIM115 - closed by `close`
            process = _Process({**self.work.environment, **os.environ}, messages)
            self.started.append(process)
        process.send(self.message)
        return process

    @cached_property
    def message(self) -> bytes:
        """What every process is sent first."""
        return packed(self.work.set_up, self.work.do)

    def end(self) -> None:
        """Start no more processes, tell all to end, and wait for it, but not for ever."""
        with self.lock:
            self.ending = True
        for process in self.started:
            process.end()
        deadline = time.monotonic() + GRACE_S
        for process in self.started:
            process.wait(deadline - time.monotonic())

    def kill(self) -> None:
        """End the processes that are left; the threads then find their pipes at an end."""
        for process in self.started:
            process.kill()

    def close(self) -> None:
        """Close the pipes; no thread may use them any more."""
        for process in self.started:
            process.close()
        self.files.close()


class _Process:
    """A process that runs `worker.main`, its pipes, and the file that it writes messages to, if it does."""

    def __init__(self, environment: dict[str, str], messages: IO[bytes] | None) -> None:
        self.messages = messages
        path = [folder or os.getcwd() for folder in sys.path]
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-c", COMMAND.format(path=path, parent=os.getpid())],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=messages,
                env=environment,
            )
        except OSError as error:
            raise _Died(f"could not be started ({error})", killed=False) from error

    def send(self, message: bytes) -> None:
        """Send a message. Raises _Died."""
        assert self.process.stdin is not None
        try:
            write_message(self.process.stdin, message)
        except BrokenPipeError:
            raise self._death() from None

    def done(self, part: bytes) -> Any:
        """The result of a part. Raises _Died, or what the part raised."""
        assert self.process.stdout is not None
        self.send(part)
        answer = read_message(self.process.stdout)
        if answer is None:
            raise self._death()
        succeeded, result = from_message(answer)
        if not succeeded:
            raise result
        return result

    def _death(self) -> _Died:
        code = self.process.wait()
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        if self.messages is not None:
            self.messages.seek(0)
            lines = self.messages.read().decode(errors="replace").strip().splitlines() or ["it left no message"]
            how += f" ({lines[-1]})"
        return _Died(how, killed=code < 0)

    def end(self) -> None:
        """Tell it to end: at once, unless what it does wants to finish something first."""
        self.process.terminate()

    def wait(self, seconds: float) -> None:
        """Wait until it has ended, but no longer."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(max(0.0, seconds))

    def kill(self) -> None:
        """End it now."""
        self.process.kill()
        self.process.wait()

    def close(self) -> None:
        """Close its pipes."""
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with suppress(BrokenPipeError):  # a process that died left something unread
                    stream.close()
