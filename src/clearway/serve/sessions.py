"""Sessions: each with an episode and draws of its own; expired ones go."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from clearway.agents.agent import State
from clearway.deploy.agent import DeployedAgent
from clearway.deploy.navigator import Decision, Selection
from clearway.scenes.sensors import RGB
from clearway.serve.decoders import Standing
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.shares import Places

ID_BYTES = 16
SEED_BITS = 64  # of a session that was given none


@dataclass(frozen=True)
class Answer:
    """A decision, whether the agent holds that it has arrived (None: it cannot tell), and the step's number, from 1."""

    decision: Decision
    arrived: bool | None
    step: int


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a session has come; a request that is answered puts another in its place.

    Attributes:
        episode: targets so far.
        steps: answered since the target was set.
        state: what the agent remembers, of one row; None until there is a target.
        seen: SHA-256 of the file that led here, a target's or a step's.
        answer: to the last step; None where there was none since the target.
        version: of the record that it was read from, where sessions are shared.
    """

    episode: int = 0
    steps: int = 0
    state: State | None = None
    seen: bytes = b""
    answer: Answer | None = None
    version: int = 0


@dataclass(eq=False)
class Session:
    """One agent on its way.

    Attributes:
        id: what clients call it by; nobody can guess another's.
        owner: name of the token that opened it; to others it is not there.
        selection: how its actions are chosen.
        seed: of the seeds of its episodes.
        used_s: when it was last asked for, on the clock of its `Sessions`.
        progress: how far it has come.
        standing: how its pictures have been.
        turn: held while a request of the session is answered, so that they are answered one after the other.
    """

    id: str
    owner: str
    selection: Selection
    seed: int
    used_s: float
    progress: Progress = Progress()
    standing: Standing = field(default_factory=Standing)
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


def begun_state(agent: DeployedAgent) -> State:
    """What an agent remembers at the begin of one episode."""
    height, width = agent.card.picture_size or (1, 1)
    return agent.reset({RGB: np.zeros((1, height, width, 3), np.uint8)}, np.zeros(1, np.int64))


def state_bytes(agent: DeployedAgent) -> int:
    """What an agent's memory of one episode takes, which every session with a target keeps."""
    return sum(values.nbytes for values in begun_state(agent).values())


def new_session(owner: str, selection: Selection, seed: int | None, now_s: float) -> Session:
    """A session without a target."""
    seed = secrets.randbits(SEED_BITS) if seed is None else seed
    return Session(secrets.token_urlsafe(ID_BYTES), owner, selection, seed, now_s)


def place_refused(places: Places, owner: str) -> str | None:
    """Take a place for another session of an owner's; what stands against it, where there is none."""
    if places.take(owner):
        return None
    if places.taken >= places.most:
        return f"{places.most} sessions are open"
    return f"{places.held(owner)} sessions of this token are open"


def too_many(held: str) -> Fault:
    """The refusal of another session."""
    return Fault("too_many_sessions", f"{held}. Close one, or try again later")


def no_such_session() -> Fault:
    """The refusal of a session that is not there."""
    return Fault("no_such_session", "no such session, or it has expired. Open a new one")


class KeepsSessions(Protocol):
    """Where sessions are: in this process, or shared by several."""

    def __len__(self) -> int:
        """Open sessions."""

    @property
    def full(self) -> bool:
        """No more can be opened."""

    async def open(self, owner: str, selection: Selection, seed: int | None) -> Session:
        """A new session. Raises Fault where there are too many, or too many of this owner's."""

    async def get(self, session_id: str, owner: str) -> Session:
        """An open session of this owner's, whose time begins anew. Raises Fault where there is none of that name."""

    async def close(self, session_id: str, owner: str) -> None:
        """End a session of this owner's. Raises Fault where there is none of that name."""

    async def progress(self, session: Session) -> Progress:
        """How far a session has come. Raises Fault where it is gone."""

    async def keep(self, session: Session, before: Progress, after: Progress) -> bool:
        """Put another in the place of a session's progress; False where that is not `before` any more.

        Cancelled, it has put nothing there. Once it has, it returns True, though it was cancelled meanwhile.
        """


class Sessions:
    """All open sessions.

    Args:
        limits: how long they live unused.
        places: for them.
        clock: seconds, monotonic.
    """

    def __init__(self, limits: Limits, places: Places, clock: Callable[[], float] = time.monotonic) -> None:
        self._limits, self._places, self._clock = limits, places, clock
        self._open: OrderedDict[str, Session] = OrderedDict()  # the one unused for longest comes first

    def __len__(self) -> int:
        self._expire()
        return len(self._open)

    @property
    def full(self) -> bool:
        """No more can be opened."""
        return len(self) >= self._places.most

    async def open(self, owner: str, selection: Selection, seed: int | None) -> Session:
        """A new session. Raises Fault where there are too many, or too many of this owner's."""
        self._expire()
        if (held := place_refused(self._places, owner)) is not None:
            raise too_many(held)
        made = new_session(owner, selection, seed, self._clock())
        self._open[made.id] = made
        return made

    async def get(self, session_id: str, owner: str) -> Session:
        """An open session of this owner's, whose time begins anew. Raises Fault where there is none of that name."""
        self._expire()
        found = self._open.get(session_id)
        if found is None or found.owner != owner:
            raise no_such_session()
        found.used_s = self._clock()
        self._open.move_to_end(session_id)
        return found

    async def close(self, session_id: str, owner: str) -> None:
        """End a session of this owner's. Raises Fault where there is none of that name."""
        self._forget(await self.get(session_id, owner))

    async def progress(self, session: Session) -> Progress:
        """How far a session has come."""
        return session.progress

    async def keep(self, session: Session, before: Progress, after: Progress) -> bool:
        """Put another in the place of a session's progress."""
        session.progress = after
        return True

    def _forget(self, session: Session) -> None:
        del self._open[session.id]
        self._places.free(session.owner)

    def _expire(self) -> None:
        oldest = self._clock() - self._limits.idle_s
        while self._open and next(iter(self._open.values())).used_s <= oldest:
            self._forget(next(iter(self._open.values())))
