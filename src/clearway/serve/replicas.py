"""Several processes that answer at one address: started, watched, started again where one ends.

All accept from one listening socket, which their parent holds open: connections wait in line while a replica is
replaced. Sessions lie in a table that all share, see `session_table`; so none is lost with a replica.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import secrets
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from types import FrameType

from clearway import files
from clearway.children import ChildProcess
from clearway.deploy.agent import DeployedAgent
from clearway.errors import ClearwayError, DeployError
from clearway.serve.hangup import on_hangup, rotating
from clearway.serve.limits import Limits
from clearway.serve.metrics import count_no_more, count_together
from clearway.serve.replica import Beats, Replica
from clearway.serve.run import Network, run_service
from clearway.serve.session_record import KEY_BYTES
from clearway.serve.shared_sessions import sessions_in
from clearway.serve.stand_in import standing_in
from clearway.serve.tokens import Tokens

LOOKS_EVERY_S = 0.2
TELLS_EVERY_S = 1.0  # to end, until they do: one that has no handler yet may miss it
END_S = 6.0  # beyond a request's deadline, after which a replica that has not ended is killed; by itself it takes 4
STUCK_S = 30.0  # without a beat, after which a replica is ended
START_S = 120.0  # for a replica's first beat
SHORT_S = 10.0  # what ended sooner is started again after a pause
MOST_FAILED = 5  # replicas in each place, before any has begun to answer: then none will
PAUSES_S = (0.2, 5.0)  # the first, and the longest; they double


@dataclass(frozen=True)
class Common:
    """What all replicas are given.

    Attributes:
        opened: opens the agent.
        network: how the service is reached.
        tokens: one of which every request must hold.
        tokens_file: which SIGHUP reads again; None: none.
        limits: of the whole service.
        count: of replicas.
        folder: of sessions and figures, which nobody else may read.
        key: seals sessions.
        beats: memory for `Beats`.
    """

    opened: Callable[[], DeployedAgent]
    network: Network
    tokens: Tokens
    tokens_file: Path | None
    limits: Limits
    count: int
    folder: Path
    key: bytes
    beats: Beats


def serve_replica(common: Common, number: int) -> None:
    """Answer as one of several, until told to end by SIGTERM."""
    count_together(common.folder, number)
    limits, tokens = common.limits, common.tokens
    try:
        agent = common.opened()
    except ClearwayError as fault:
        sys.exit(f"replica {number + 1}: {fault}")
    sessions = sessions_in(common.folder, agent, limits, tokens, common.key)
    replica = Replica(number, sessions, common.beats, common.folder)
    with rotating(tokens, common.tokens_file):
        run_service(agent, common.network, tokens, limits.divided(common.count), replica)


def run_replicas(
    opened: Callable[[], DeployedAgent],
    network: Network,
    tokens: Tokens,
    tokens_file: Path | None,
    limits: Limits,
    count: int,
) -> None:
    """Let replicas answer until told to end (SIGINT, SIGTERM); each ends as `run_service` says.

    Args:
        opened: opens the agent; a function that can be pickled.
        network: how the service is reached; its `log` can be pickled too.
        tokens: one of which every request must hold.
        tokens_file: which SIGHUP reads again, in all replicas, as it does the certificate; None: none.
        limits: of the whole service.
        count: of replicas.

    Raises:
        DeployError: none begins to answer, however often it is tried.
    """
    logging.basicConfig(format="%(asctime)s %(levelname)s %(message)s", level=logging.WARNING)
    beats = Beats(multiprocessing.get_context("spawn").RawArray("d", 2 * count))
    with files.part_folder(files.cache_dir() / "replicas") as folder, _told_to_end() as ending:
        key = secrets.token_bytes(KEY_BYTES)
        common = Common(opened, network, tokens, tokens_file, limits, count, folder, key, beats)
        places = [_Place(common, number) for number in range(count)]
        try:
            renewing = tokens_file is not None or network.certificate is not None
            told = on_hangup(lambda: _tell(places, signal.SIGHUP)) if renewing else nullcontext()
            with told, rotating(tokens, tokens_file), standing_in(network, beats.any_fresh):
                while not ending:
                    for place in places:
                        place.look()
                    _check_begun(places)
                    wait([place.sentinel for place in places if place.sentinel is not None], LOOKS_EVERY_S)
        finally:
            _end(places, limits.deadline_s + END_S, lambda: ending.count(signal.SIGINT) > 1)


class _Place:
    """Where one replica is, and after it the next.

    Attributes:
        has_answered: one of them has begun to answer.
        failed: how many ended before that.
    """

    def __init__(self, common: Common, number: int) -> None:
        self._common, self._number = common, number
        self._process: ChildProcess | None = None
        self._begun_s, self._next_s, self._pause_s = 0.0, 0.0, PAUSES_S[0]
        self._told = self._told_before = 0  # signals, also where there was no replica to tell; before it started
        self.has_answered, self.failed = False, 0

    @property
    def sentinel(self) -> int | None:
        """Is ready once the replica has ended; None where there is none."""
        return None if self._process is None else self._process.sentinel

    @property
    def is_alive(self) -> bool:
        """Whether there is a replica that has not ended."""
        return self._process is not None and self._process.is_alive()

    def look(self) -> None:
        """Start a replica where there is none and it is time; end a stuck one."""
        now = time.monotonic()
        if self._process is None:
            if now >= self._next_s:
                self._start(now)
            return
        alive, last_s = self._process.is_alive(), self._common.beats.last_s(self._number)
        self.has_answered = self.has_answered or last_s > 0
        if alive:
            if now > (last_s + STUCK_S if last_s else self._begun_s + START_S):
                self._process.kill()
            return
        code, self._process = self._process.exitcode, None
        self._common.beats.forget(self._number)
        count_no_more(self._common.folder, self._number)
        self._pause(now, f"exit code {code}")

    def _pause(self, now: float, reason: str | None) -> None:
        """Let another replica take the place of one that ended: soon, later where it ended early again and again."""
        untold = self._told == self._told_before  # else SIGHUP may have ended it, and it is to have other tokens
        self.failed += untold and not self.has_answered
        log = logging.getLogger("clearway.serve")
        log.warning("replica %d has ended (%s); another takes its place", self._number + 1, reason)
        lasted = now - self._begun_s >= SHORT_S
        self._next_s = now if lasted else now + self._pause_s
        self._pause_s = PAUSES_S[0] if lasted else min(2 * self._pause_s, PAUSES_S[1])

    def _start(self, now: float) -> None:
        name = f"replica-{self._number + 1}"
        process = ChildProcess(target=serve_replica, args=(self._common, self._number), name=name)
        self._begun_s, self._told_before = now, self._told
        try:
            process.start()
        except OSError as fault:  # it was killed before it had read what it is to do, or no process can be started
            self._pause(now, fault.strerror)
        else:
            self._process = process
            if self._told != self._told_before:  # to read the tokens again, when it may have had the old ones already
                self.tell(signal.SIGHUP)

    def tell(self, number: signal.Signals) -> None:
        """Send a signal to the replica, where there is one; one that has not begun to answer ends by SIGHUP too."""
        self._told += 1
        if self._process is not None and self._process.is_alive() and self._process.pid is not None:
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(self._process.pid, number)

    def kill(self) -> None:
        """End the replica, whatever it does, and wait for its end."""
        if self._process is not None:
            self._process.kill()
            self._process.join()


def _tell(places: list[_Place], number: signal.Signals) -> None:
    for place in places:
        place.tell(number)


def _check_begun(places: list[_Place]) -> None:
    """Raise DeployError where no replica has ever answered, and every place has had enough of them."""
    if not any(place.has_answered for place in places) and all(place.failed >= MOST_FAILED for place in places):
        problem = f"no replica begins to answer, {MOST_FAILED} tries in each place"
        raise DeployError(f"{problem}. Mend what the lines above say, or try without --replicas")


def _end(places: list[_Place], within_s: float, at_once: Callable[[], bool]) -> None:
    """Tell all replicas to end, and wait; who has not after `within_s`, or when it is to be `at_once`, is killed."""
    latest = time.monotonic() + within_s
    while running := [place for place in places if place.is_alive]:
        left_s = latest - time.monotonic()
        if left_s <= 0 or at_once():
            break
        _tell(running, signal.SIGTERM)
        wait([place.sentinel for place in running if place.sentinel is not None], min(left_s, TELLS_EVERY_S))
    for place in places:
        place.kill()


@contextmanager
def _told_to_end() -> Iterator[list[int]]:
    """A list to which a signal is added when the service is told to end."""
    told: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        told.append(number)

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield told
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
